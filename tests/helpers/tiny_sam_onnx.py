"""The ONNX files of a tiny SAM 2.1 with random weights, for tests without torch.

python -m tests.helpers.tiny_sam_onnx     # writes them anew
"""

import os
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

ONNX = Path(__file__).parents[1] / "perception" / "sam" / "data"


def shorten_names(path: Path) -> None:
    """Names in an ONNX file, most of it where weights are few, become numbers; inputs and outputs keep theirs."""
    import onnx

    model = onnx.load(str(path))
    kept = [v.name for v in (*model.graph.input, *model.graph.output)]
    _shorten(model.graph, {name: name for name in ("", *kept)})
    onnx.checker.check_model(model)
    onnx.save(model, str(path))


def _shorten(graph: Any, number: dict[str, str]) -> None:
    del graph.value_info[:]
    for array in graph.initializer:
        array.name = number.setdefault(array.name, str(len(number)))
    for node in graph.node:
        node.name = node.doc_string = ""
        del node.metadata_props[:]
        for names in (node.input, node.output):
            names[:] = [number.setdefault(name, str(len(number))) for name in names]
        for attribute in node.attribute:
            if attribute.HasField("g"):
                _shorten(attribute.g, number)
                for value in attribute.g.output:
                    value.name = number[value.name]


def main() -> None:
    """Writes both files."""
    from tests.helpers.tiny_sam import import_torchvision, save_sam2
    from tools.sam2_onnx import export_sam2

    os.environ["HF_HUB_OFFLINE"] = "1"
    import_torchvision()
    with TemporaryDirectory() as folder:
        save_sam2(Path(folder))
        export_sam2(folder, ONNX)
    for path in ONNX.glob("*.onnx"):
        shorten_names(path)


if __name__ == "__main__":
    main()
