"""Training of the networks: losses say what they should, interrupted training goes on, files hold what was trained."""

from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is not installed")
pytest.importorskip("onnx", reason="onnx is not installed")

from tools.eyes import descriptor, train  # noqa: E402
from tools.eyes.export import export_descriptor  # noqa: E402
from tools.eyes.network import OUTPUTS, Descriptor, Eyes  # noqa: E402
from tools.eyes.shipped import shipped_descriptor, shipped_eyes  # noqa: E402
from torc.perception.embedded.inputs import CHANNELS  # noqa: E402
from torc.perception.embedded.instances import OFFSETS  # noqa: E402
from torc.perception.embedded.model import DESCRIPTOR, SIDE_PX, descriptor_inputs, onnx_session, segment_patch  # noqa: E402  # noqa: E402


def test_partners_are_those_of_the_offsets(rng):
    label = torch.tensor(rng.integers(0, 5, (1, 60, 70)))
    for dr, dc in OFFSETS:
        here, partner = train.shifted(label, dr, dc)
        rows, cols = here.shape[1:]
        for r, c in zip(rng.integers(0, rows, 20), rng.integers(0, cols, 20)):
            column = c + max(0, -dc)
            assert here[0, r, c] == label[0, r, column]
            assert partner[0, r, c] == label[0, r + dr, column + dc]


def test_right_answers_cost_next_to_nothing(rng):
    label = torch.tensor(np.kron(rng.integers(-1, 4, (1, 8, 8)), np.ones((1, 12, 12), int)))
    right = torch.zeros(1, OUTPUTS, *label.shape[1:])
    right[:, 0] = torch.where(label >= 0, 12.0, -12.0)
    for k, (dr, dc) in enumerate(OFFSETS, start=1):
        here, partner = train.shifted(label, dr, dc)
        train.shifted(right[:, k], dr, dc)[0][:] = torch.where((here == partner) & (here >= 0), 12.0, -12.0)
    assert max(float(v) for v in train.loss_of(right, label)) < 1e-3
    assert min(float(v) for v in train.loss_of(-right, label)) > 5


def test_the_network_keeps_the_size():
    out = Eyes((8, 8, 8, 8, 8)).eval()(torch.zeros(1, CHANNELS, 64, 96))
    assert out.shape == (1, OUTPUTS, 64, 96)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # the exporter that needs nothing but torch
def test_a_descriptors_training_goes_on_and_its_file_is_the_network(tmp_path, rng):
    for scene in range(2):
        crops = rng.integers(0, 255, (6, SIDE_PX, SIDE_PX, 4)).astype(np.uint8)
        portraits = rng.integers(0, 255, (3, 2, SIDE_PX, SIDE_PX, 4)).astype(np.uint8)
        np.savez(
            tmp_path / f"scene_{scene}.npz", crops=crops, object_ids=np.arange(6) % 3, portraits=portraits
        )
    files, weights = sorted(tmp_path.glob("*.npz")), tmp_path / "d.pt"
    config = descriptor.DescriptorConfig(steps=1, scenes=2, objects=3)
    descriptor.train_descriptor(files, weights, config)
    first = torch.load(weights, weights_only=True)
    descriptor.train_descriptor(files, weights, replace(config, steps=3))
    state = torch.load(weights, weights_only=True)
    assert (first["step"], state["step"]) == (1, 3)
    further = tmp_path / "further.pt"
    descriptor.train_descriptor(files, further, replace(config, shipped=True))
    assert torch.load(further, weights_only=True)["net"]["layers.1.num_batches_tracked"] == 1
    export_descriptor(weights, tmp_path / "d.onnx")
    import onnxruntime

    net = Descriptor()
    net.load_state_dict(state["net"])
    inputs = descriptor_inputs(rng.integers(0, 255, (3, SIDE_PX, SIDE_PX, 4)).astype(np.uint8))
    here = net.eval()(torch.tensor(inputs)).detach().numpy()
    (there,) = onnxruntime.InferenceSession(tmp_path / "d.onnx").run(None, {"inputs": inputs})
    np.testing.assert_allclose(there, here, atol=0.01)


def test_the_shipped_network_can_be_trained_further(rng):
    """It says at first what the shipped file says, and the same with the statistics of what it is trained on."""
    inputs = rng.standard_normal((6, CHANNELS, 64, 64)).astype(np.float32)
    net = shipped_eyes(torch.from_numpy(inputs))
    said = np.stack([segment_patch(one) for one in inputs])
    with torch.no_grad():
        np.testing.assert_allclose(torch.sigmoid(net(torch.from_numpy(inputs))), said, atol=1e-4)
        trained = torch.sigmoid(net.train()(torch.from_numpy(inputs)))
    np.testing.assert_allclose(trained, said, atol=1e-3)


def test_the_shipped_descriptor_can_be_trained_further(rng):
    inputs = descriptor_inputs(rng.integers(0, 255, (40, SIDE_PX, SIDE_PX, 4)).astype(np.uint8))
    net = shipped_descriptor(torch.from_numpy(inputs))
    said = onnx_session(DESCRIPTOR, 1).run(None, {"inputs": inputs})[0]
    with torch.no_grad():
        np.testing.assert_allclose(net(torch.from_numpy(inputs)), said, atol=1e-3)
        np.testing.assert_allclose(net.train()(torch.from_numpy(inputs)), said, atol=5e-3)


def test_things_of_one_paint_differ_by_shape_and_pattern_alone(rng):
    pictures = []
    for _ in range(12):
        picture = np.zeros((3, 8, 8, 4), np.uint8)
        picture[:, 2:6, 2:6, :3] = rng.integers(90, 110, (3, 4, 4, 3)) + rng.integers(-40, 60, 3)
        picture[:, 2:6, 2:6, 3] = 255
        pictures.append(picture)
    out = descriptor.alike(pictures, 1.0, rng)
    means = np.array([p[1:][p[1:, ..., 3] > 0][:, :3].mean(axis=0) for p in out])
    for group in (means[np.argsort(means[:, 0])][:6], means[np.argsort(means[:, 0])][6:]):
        assert np.ptp(group, axis=0).max() < 4
    for picture, made in zip(pictures, out, strict=True):
        np.testing.assert_array_equal(made[..., 3], picture[..., 3])
        assert not made[picture[..., 3] == 0].any()
        assert np.ptp(made[made[..., 3] > 0].astype(float), axis=0).max() > 8  # the pattern stays
    unchanged = sum(a is b for a, b in zip(descriptor.alike(pictures, 0.5, rng), pictures, strict=True))
    assert unchanged == 6
