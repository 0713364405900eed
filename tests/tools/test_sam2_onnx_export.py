"""What writes SAM 2.1 as ONNX files writes what torc reads."""

import numpy as np
import pytest

from tests.helpers.tiny_sam import import_torchvision, save_sam2
from torc.perception.sam.onnx_files import DECODER, ENCODER, load_sam2_onnx, masks_in_boxes


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The files of a tiny SAM 2.1, and its weights."""
    for name in ("torch", "transformers", "onnx"):
        pytest.importorskip(name, reason=f"{name} is not installed")
    try:
        import_torchvision()
    except ImportError:
        pytest.skip("torchvision is not installed")
    from tools.sam2_onnx import main

    weights, out = tmp_path_factory.mktemp("weights"), tmp_path_factory.mktemp("onnx")
    save_sam2(weights)
    assert main(["--weights", str(weights), "--out", str(out)]) == 0
    return weights, out


@pytest.mark.long
def test_the_files_can_be_read_and_speak_as_the_weights_do(written, rng):
    from torc.perception.sam import sam2
    from torc.perception.sam.network import SAM2, Runtime, load_network

    weights, out = written
    assert {p.name for p in out.iterdir()} == {ENCODER, DECODER}
    rgb = rng.integers(0, 256, (128, 128, 3), np.uint8)
    corners = np.array([[5, 5, 60, 70], [30, 40, 120, 100], [0, 0, 128, 128], [70, 3, 90, 30]], np.float32)
    masks, expected = masks_in_boxes(rgb, corners, load_sam2_onnx(str(out), 1))
    wanted, iou = sam2.masks_in_boxes(rgb, corners, load_network(SAM2, str(weights), Runtime()))
    assert 0.01 < masks.mean() < 0.99
    assert np.mean(masks != wanted) < 0.001
    assert expected == pytest.approx(iou, abs=1e-4)


def test_weights_that_cannot_be_had_end_it_with_a_remedy(written, tmp_path, capsys):
    from tools.sam2_onnx import main

    assert main(["--weights", str(tmp_path / "none"), "--out", str(tmp_path / "out")]) == 2
    assert "no folder" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_file_that_says_something_else_is_found_out(written, tmp_path):
    import torch

    from tools.sam2_onnx import Encoder, _check
    from torc.errors import InputError
    from torc.perception.sam.network import SAM2, Runtime, load_network

    weights, out = written
    model = load_network(SAM2, str(weights), Runtime()).model
    picture = torch.zeros(1, 3, 128, 128)
    _check(Encoder(model), (picture,), out / ENCODER)

    class Other(torch.nn.Module):
        def forward(self, x):
            return tuple(m + 1 for m in Encoder(model)(x))

    with pytest.raises(InputError, match="something else than torch"):
        _check(Other(), (picture,), out / ENCODER)
