"""Draws all objects of the catalogue into a directory of object files, with an index of their facts."""

import argparse
import json
from pathlib import Path

from PIL import Image

from tools.objects.catalogue import ALL_KINDS
from tools.objects.drawing import draw
from torc.objects.library import INDEX_FILE, SHIPPED_OBJECTS
from torc.objects.object_files import save_object


def write_objects(directory: Path) -> int:
    """Writes all objects of the catalogue and their index, over those of the same names; how many there are."""
    facts = []
    for kind in ALL_KINDS:
        for variant in kind.variants:
            save_object(draw(kind, variant), directory / variant.name, overwrite=True)
            for texture in (directory / variant.name).glob("*.png"):
                Image.open(texture).copy().save(texture, optimize=True)
            facts.append(
                {
                    "name": variant.name,
                    "kind": kind.name,
                    "description": variant.description,
                    "mass_kg": variant.mass_kg,
                    "held_out": kind.held_out,
                }
            )
    lines = ",\n".join(json.dumps(entry) for entry in facts)
    (directory / INDEX_FILE).write_text(f"[\n{lines}\n]\n", encoding="utf-8")
    return len(facts)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m tools.objects", description="Draws the shipped objects.")
    parser.add_argument("--out", type=Path, default=SHIPPED_OBJECTS, help="where to")
    out = parser.parse_args().out
    print(f"{write_objects(out)} objects in {out}")


if __name__ == "__main__":
    main()
