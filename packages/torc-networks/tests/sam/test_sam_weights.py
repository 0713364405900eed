"""Weights: where they come from, what they are called, and what is said where they cannot be had."""

import builtins
import re
import shutil
import sys
from pathlib import Path

import pytest

from torc.errors import InputError, MissingDependencyError
from torc.pipeline.building import make_stage
from torc.registry.context import BuildContext
from torc.specs.conditions import PipelineSpec
from torc.workspace.workspace_files import load_workspace
from torc_networks.sam.inference import masks_in_boxes
from torc_networks.sam.network import GROUNDING_DINO, SAM2, Kind, Runtime, load_network
from torc_networks.sam.perception import GroundedSam2Config, GroundedSam2Perception, Sam3Config

PAGE = (Path(__file__).parents[4] / "docs" / "networks.md").read_text()


def test_the_page_names_the_licences_of_the_defaults():
    for config, names in ((GroundedSam2Config, ("detector", "segmenter")), (Sam3Config, ("weights",))):
        for name in names:
            weights = getattr(config(), name)
            assert weights in config.__doc__
            assert re.search(rf"^\| `{weights}` \| (Apache-2.0|SAM License) \|", PAGE, re.M)


def test_the_page_names_every_setting_of_words():
    for config in (GroundedSam2Config(), Sam3Config()):
        for name in vars(config):
            if name not in ("clouds", "tracking", "target"):
                assert f"`perception.{name}" in PAGE, name


def test_making_the_stages_loads_nothing(torch):
    load_network.cache_clear()
    for name in ("grounded-sam2", "sam3"):
        spec = PipelineSpec(perception=name, settings={"perception.most": 7, "perception.words.sure": 0.6})
        part = make_stage(spec, "perception", BuildContext(workspace=load_workspace()), rough=True)
        assert part.config.most == 7
        assert part.words.sure == 0.6
        assert part.config.clouds.edge_slope == 4.0
        assert not getattr(part, "needs_pictures", False)
        assert not getattr(part, "needs_labels", False)
    assert load_network.cache_info().currsize == 0


def test_a_network_is_loaded_once(tiny):
    one, two = (load_network(SAM2, tiny("sam2"), Runtime()) for _ in range(2))
    assert one.model is two.model
    assert not one.model.training


def test_weights_that_are_not_here_say_how_to_get_them(torch):
    with pytest.raises(InputError) as caught:
        load_network(SAM2, "facebook/sam2.1-hiera-tiny", Runtime())
    for part in (
        "hf download facebook/sam2.1-hiera-tiny --local-dir",
        "ask for access",
        "hf auth login",
        "docs/networks.md",
    ):
        assert part in str(caught.value)


@pytest.mark.parametrize(
    "name", ["", "/no/such/folder", "./weights", "~/no-such-weights", "a/b/c", "weights"]
)
def test_a_folder_that_is_not_there_is_said_to_be_none(torch, name):
    with pytest.raises(InputError, match="no folder"):
        load_network(SAM2, name, Runtime())


def test_a_folder_without_weights_or_with_those_of_another_network_is_refused(tiny, tmp_path):
    with pytest.raises(InputError, match="cannot be loaded"):
        load_network(GROUNDING_DINO, str(tmp_path), Runtime())
    with pytest.raises(InputError, match=r"arrays are missing|cannot be loaded"):
        load_network(SAM2, tiny("sam3"), Runtime())
    with pytest.raises(InputError, match=r"arrays are missing|cannot be loaded"):
        load_network(GROUNDING_DINO, tiny("sam2"), Runtime())


def test_weights_that_lack_most_of_a_network_are_refused_though_transformers_would_make_up_the_rest(
    tiny, tmp_path
):
    from safetensors.numpy import load_file, save_file

    shutil.copytree(tiny("sam2"), tmp_path, dirs_exist_ok=True)
    file = tmp_path / "model.safetensors"
    arrays = load_file(file)
    save_file({k: a for k, a in arrays.items() if "vision_encoder" in k}, file, {"format": "pt"})
    with pytest.raises(InputError, match="arrays are missing"):
        load_network(SAM2, str(tmp_path), Runtime())


def test_the_hubs_video_model_is_read_as_one_for_pictures(tiny, rng):
    """Its weights hold a tracker too, which is left out."""
    network = load_network(SAM2, tiny("sam2-video"), Runtime())
    assert type(network.model).__name__ == "Sam2Model"
    rgb = rng.integers(0, 256, (60, 80, 3), "uint8")
    found = masks_in_boxes(rgb, rng.uniform(0, 60, (2, 4)).astype("float32"), network)
    assert found.masks.shape == (2, 60, 80)


def test_cuda_where_there_is_none_names_the_remedy(torch, tiny, monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(InputError, match="device cpu"):
        load_network(SAM2, tiny("sam2"), Runtime(device="cuda"))


@pytest.mark.parametrize("library", ["torch", "torchvision", "transformers"])
def test_without_a_library_the_extra_is_named(monkeypatch, library):
    load_network.cache_clear()
    monkeypatch.setitem(sys.modules, library, None)
    if library != "torch":
        pytest.importorskip("torch", reason="the extra `sam` is not installed: no torch")
    with pytest.raises(MissingDependencyError, match=r"scripts/setup sam") as caught:
        load_network(SAM2, "facebook/sam2.1-hiera-tiny", Runtime())
    assert "torch" in str(caught.value) or "transformers" in str(caught.value)


def test_a_torchvision_for_another_torch_says_where_both_come_from(torch, monkeypatch):
    real = builtins.__import__

    def importing(name, *args, **kwargs):
        if name == "torchvision":
            raise RuntimeError("operator torchvision::nms does not exist")
        return real(name, *args, **kwargs)

    monkeypatch.delitem(sys.modules, "torchvision")
    monkeypatch.setattr(builtins, "__import__", importing)
    with pytest.raises(MissingDependencyError, match="both from one index"):
        load_network(SAM2, "facebook/sam2.1-hiera-tiny", Runtime())


def test_a_transformers_without_the_network_names_the_extra(tiny):
    newer = Kind("SAM 9", "Sam9Processor", "Sam9Model")
    with pytest.raises(MissingDependencyError, match="SAM 9 in transformers"):
        load_network(newer, tiny("sam3"), Runtime())


def test_the_stage_takes_a_folder_from_its_settings(tiny):
    settings = {
        "perception.detector": tiny("dino"),
        "perception.segmenter": tiny("sam2"),
        "perception.one_call": True,
    }
    part = make_stage(PipelineSpec(perception="grounded-sam2", settings=settings), "perception")
    assert isinstance(part, GroundedSam2Perception)
    assert part.config.one_call
    assert part.config.detector == tiny("dino")
