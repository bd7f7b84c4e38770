"""Examples below the help of each command."""

from __future__ import annotations

from collections.abc import Mapping

#: Two examples of each command; a sub-command's words are joined by a blank.
EXAMPLES: Mapping[str, tuple[str, ...]] = {
    "lippmann": ("lippmann render model.glb --display looking-glass-portrait --open", "lippmann preview model.glb"),
    "render": (
        "lippmann render model.glb --display looking-glass-portrait --open",
        "lippmann render teapot --display print --lpi 60 --ppi 720 --size 8x10in -o teapot.tif",
    ),
    "preview": ("lippmann preview model.glb --turn 30", "lippmann preview model.glb --display panel-4k -o seen.png"),
    "proof": (
        "lippmann proof print:lpi=60,ppi=720,size=8x10in,thickness=26mil -o proof.pdf",
        "lippmann proof panel-4k --json",
    ),
    "plan": ("lippmann plan model.glb --display panel-8k", "lippmann plan teapot --spp 64 --memory 4G"),
    "worker": (
        "lippmann worker tcp://10.0.0.1:8786",
        "lippmann worker tls://render.example:8786 --tls-ca ca.pem --tls-cert me.pem --tls-key me.key",
    ),
    "displays": ("lippmann displays", "lippmann displays --json"),
    "doctor": ("lippmann doctor", "lippmann doctor --json"),
    "info": ("lippmann info model.png", "lippmann info model.png --json"),
    "views": ("lippmann views model.png -o views", "lippmann views model.exr -o views --format png"),
    "micro-images": (
        "lippmann micro-images model.png -o lenses",
        "lippmann micro-images model.exr -o lenses",
    ),
    "compose": ("lippmann compose views -o again.png", "lippmann compose lenses -o again.exr --bits 32"),
    "replay": (
        "lippmann replay model.png --sweep",
        "lippmann replay model.png --sbs half --eye 20,0,600 -o pair.png",
    ),
    "refocus": (
        "lippmann refocus model.png --plane -20 -o back.png",
        "lippmann refocus model.exr --planes -40:40:9 -o stack",
    ),
    "export": ("lippmann export model.exr --as hci -o scene", "lippmann export model.exr --as eslf -o scene.png"),
    "import": ("lippmann import scene -o model.exr", "lippmann import scene.png --as eslf -o model.exr"),
    "studio": ("lippmann studio", "lippmann studio model.glb --display looking-glass-portrait"),
    "show": ("lippmann show model.png", "lippmann show model.exr --display my-display.toml"),
    "view": ("lippmann view model.png", "lippmann view model.png --export model.html"),
    "interlace": (
        "lippmann interlace photos/*.jpg --lpi 60 --ppi 720 --size 8x10in -o print.tif",
        "lippmann interlace day.jpg night.jpg --lenses across --lpi 40 --ppi 600 --size 20x15cm -o flip.tif",
    ),
    "weave": (
        "lippmann weave city_qs8x6a0.75.png --display looking-glass-portrait -o city.png",
        "lippmann weave photos --display panel-4k --views nearest -o photos.tif",
    ),
    "pitch-test": (
        "lippmann pitch-test --lpi 60 --ppi 720 --size 20x10cm -o test.tif",
        "lippmann pitch-test --lpi 75 --ppi 1440 --size 8x4in --strips 31 -o test.tif",
    ),
    "marks": (
        "lippmann marks print.tif -o marked.tif --job-sheet job.pdf",
        "lippmann marks print.png --margin 0.5in -o marked.png",
    ),
    "compare": ("lippmann compare reference.exr test.png", "lippmann compare reference.exr test.exr --json"),
    "reproduce": ("lippmann reproduce -o report", "lippmann reproduce --quick -o report"),
    "quilt render": (
        "lippmann quilt render model.glb --display portrait",
        "lippmann quilt render model.glb --turntable 48 -o turn.mp4",
    ),
    "quilt pack": (
        "lippmann quilt pack views -o city_qs8x6a0.75.png",
        "lippmann quilt pack views --bits 16 -o city_qs8x6a0.75.tif",
    ),
    "quilt unpack": (
        "lippmann quilt unpack city_qs8x6a0.75.png -o views",
        "lippmann quilt unpack city_qs8x6a0.75.png --bits 16 -o views",
    ),
    "quilt sizes": ("lippmann quilt sizes", "lippmann quilt sizes --json"),
    "calibrate pattern": (
        "lippmann calibrate pattern stripes --display panel-4k -o stripes.png",
        "lippmann calibrate pattern pitch --display panel-4k --fields 15 -o pitch.png",
    ),
    "calibrate page": (
        "lippmann calibrate page panel-4k -o my-panel.toml",
        "lippmann calibrate page my-panel.toml --no-browser -o better.toml",
    ),
}
