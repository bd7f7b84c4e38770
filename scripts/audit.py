"""Asks pip-audit whether versions of installed packages have known vulnerabilities.

Leaves with 1 if there are any, and with 0 if there are none or if the list of vulnerabilities cannot be reached: a
machine without that network has nothing to say.
"""

from __future__ import annotations

import json
import subprocess
import sys

_COMMAND = (sys.executable, "-m", "pip_audit", "--skip-editable", "--progress-spinner", "off", "--format", "json")
_SECONDS = 300


def main() -> int:
    """Run pip-audit and print what it found."""
    try:
        run = subprocess.run(_COMMAND, capture_output=True, text=True, timeout=_SECONDS, check=False)
        packages = json.loads(run.stdout)["dependencies"]
    except (subprocess.TimeoutExpired, ValueError, KeyError):
        print("audit: pip-audit gave no answer: skipped")
        return 0
    audited = [package for package in packages if "skip_reason" not in package]
    if not audited:
        print("audit: the list of known vulnerabilities cannot be reached: skipped")
        return 0
    found = [(package, issue) for package in audited for issue in package["vulns"]]
    for package, issue in found:
        fixed = ", ".join(issue["fix_versions"]) or "no version yet"
        print(f"audit: {package['name']} {package['version']}: {issue['id']}, fixed in {fixed}")
    print(f"audit: {len(audited)} packages, {len(found)} known vulnerabilities")
    return 1 if found else 0


if __name__ == "__main__":
    raise SystemExit(main())
