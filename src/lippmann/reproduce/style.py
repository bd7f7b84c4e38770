"""The style sheet of the page: one column, system fonts, light and dark by the reader's own setting."""

STYLE = """
:root {
  color-scheme: light dark;
  --ground: #fbfaf8; --card: #ffffff; --ink: #1d2126; --soft: #5d656f; --rule: #dfdcd6;
  --accent: #2266b3;
}
@media (prefers-color-scheme: dark) {
  :root {
    --ground: #14171b; --card: #1b1f25; --ink: #e6e4df; --soft: #9aa3ad; --rule: #323841;
    --accent: #74b0f4;
  }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body {
  margin: 0 auto; padding: 2rem 1.25rem 4rem; max-width: 66rem; background: var(--ground); color: var(--ink);
  font: 1rem/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif;
}
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 0 .4rem; letter-spacing: -.01em; }
h2 { font-size: 1.25rem; margin: 3.2rem 0 .6rem; padding-top: 1rem; border-top: 1px solid var(--rule); }
h3 { font-size: 1rem; margin: 2rem 0 .5rem; }
header h3 { margin: 1.4rem 0 .5rem; }
p { max-width: 44rem; margin: .6rem 0; }
a { color: var(--accent); }
.soft { color: var(--soft); }
.facts {
  display: grid; grid-template-columns: repeat(auto-fit, minmax(11rem, 1fr)); gap: .75rem; margin: 0; padding: 0;
}
.facts > div {
  display: flex; flex-direction: column-reverse; justify-content: flex-end;
  background: var(--card); border: 1px solid var(--rule); border-radius: .5rem; padding: .8rem 1rem;
}
.facts dt { color: var(--soft); font-size: .85rem; line-height: 1.35; }
.facts dd { margin: 0 0 .25rem; font-size: 1.5rem; font-weight: 600; font-variant-numeric: tabular-nums; }
nav ul {
  list-style: none; padding: 0; margin: 1rem 0 0; display: flex; flex-wrap: wrap; gap: .3rem 1.1rem; font-size: .95rem;
}
.scroll { overflow-x: auto; margin: .3rem 0 1rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .92rem; min-width: 100%; }
.caption { margin: 1.2rem 0 .3rem; font-size: .95rem; color: var(--soft); }
.wrap td, .wrap th { white-space: normal; }
th, td { padding: .32rem .6rem; text-align: right; white-space: nowrap; border-bottom: 1px solid var(--rule); }
th:first-child, td:first-child { text-align: left; padding-left: 0; }
thead th { font-weight: 600; color: var(--soft); vertical-align: bottom; white-space: normal; line-height: 1.25; }
colgroup + colgroup { border-left: 1px solid var(--rule); }
thead .over th { border-bottom: 0; padding-bottom: 0; color: var(--ink); text-align: center; }
thead th:first-child, tbody th { position: sticky; left: 0; background: var(--ground); }
tbody th { font-weight: 400; }
.chart { max-width: 44rem; margin: 1rem 0 .5rem; }
.figures {
  display: grid; grid-template-columns: repeat(auto-fill, minmax(min(24rem, 100%), 1fr)); gap: 1.2rem; margin: 1rem 0;
}
figure { margin: 0; }
figure img { width: 100%; height: auto; display: block; border-radius: .25rem; background: #000; }
figcaption { color: var(--soft); font-size: .88rem; line-height: 1.4; padding-top: .4rem; }
details { border-top: 1px solid var(--rule); padding: .6rem 0; }
summary { cursor: pointer; font-weight: 600; }
@media (max-width: 30rem) {
  body { padding: 1.25rem .9rem 3rem; }
  h1 { font-size: 1.5rem; }
  .facts { grid-template-columns: 1fr 1fr; }
  .facts dd { font-size: 1.2rem; }
}
@media print { body { max-width: none; } details { display: block; } }
"""
