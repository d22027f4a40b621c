# SPDX-License-Identifier: Apache-2.0
"""LPIPS: weights are found, checked and put in the right layers; the distance equals an independent computation.

The networks' files hold random numbers made here: they test the code, not the metric.
"""

from __future__ import annotations

import hashlib
import importlib.util
from pathlib import Path

import numpy as np
import pytest

from mfo_backend.metrics.judges.packages import LPIPS, require_torch
from mfo_backend.metrics.losses.loss import make_loss
from mfo_backend.types.errors import BadInputError, SetupError
from mfo_backend.types.image import Encoding, Image

pytestmark = pytest.mark.judges
if not all(map(importlib.util.find_spec, ("torch", "lpips"))):
    pytest.skip("the extra `judges` is not installed", allow_module_level=True)
torch = require_torch("LPIPS", LPIPS)

from mfo_backend.metrics.lpips import weight_files, weights  # noqa: E402
from mfo_backend.metrics.lpips.distance import Lpips, _unit  # noqa: E402
from mfo_backend.metrics.lpips.pu_values import PuValues  # noqa: E402
from mfo_backend.metrics.lpips.trunks import CHANNELS, LEAST_SIZE, Trunk  # noqa: E402

NETS = ("alex", "vgg", "squeeze")


@pytest.fixture(scope="session")
def files(tmp_path_factory):
    """A folder with one file per network, in the layout torchvision publishes, of random numbers."""
    folder = tmp_path_factory.mktemp("weights")
    generator = torch.Generator().manual_seed(3)
    for net in NETS:
        states = {
            name: torch.randn(value.shape, generator=generator) * (2 / max(value[0].numel(), 1)) ** 0.5
            for name, value in Trunk(net).state_dict().items()
        }
        states["classifier.1.weight"] = torch.zeros(2, 2)  # the published files go on to class scores
        torch.save(states, folder / weights.TRUNK_FILES[net][-1])
    return folder


@pytest.fixture
def given(files, monkeypatch):
    monkeypatch.setenv("MFO_LPIPS_WEIGHTS", str(files))
    return files


@pytest.fixture
def empty(tmp_path, monkeypatch):
    """Neither a folder nor a cache with weights."""
    monkeypatch.delenv("MFO_LPIPS_WEIGHTS", raising=False)
    monkeypatch.setenv("TORCH_HOME", str(tmp_path))
    return tmp_path


def pair(shape=(37, 41, 3), dtype=np.float32):
    reference, test = np.random.default_rng(1).uniform(0, 1, (2, *shape))
    return reference.astype(dtype), (0.7 * reference + 0.3 * test).astype(dtype)


def _convolve(image, kernel, bias, stride, padding):
    """Correlation of (channels, height, width) with (outputs, channels, k, k) and the rectifier, by windows."""
    image = np.pad(image, ((0, 0), (padding, padding), (padding, padding)))
    size = kernel.shape[-1]
    windows = np.lib.stride_tricks.sliding_window_view(image, (size, size), (1, 2))[:, ::stride, ::stride]
    return np.maximum(np.einsum("chwij,ocij->ohw", windows, kernel, optimize=True) + bias[:, None, None], 0)


def _pool(image):
    return np.lib.stride_tricks.sliding_window_view(image, (3, 3), (1, 2))[:, ::2, ::2].max((-1, -2))


def _alex_by_hand(states, heads, reference, test):
    """LPIPS with AlexNet in NumPy, float64; layer sizes of Krizhevsky 2014, equation 1 of Zhang et al. 2018."""
    features = []
    for image in (reference, test):
        image = (2 * image.astype(np.float64) - 1 - [-0.030, -0.088, -0.188]) / [0.458, 0.448, 0.450]
        image, maps = image.transpose(2, 0, 1), []
        for index, stride, padding, pooled in ((0, 4, 2, 0), (3, 1, 2, 1), (6, 1, 1, 1), (8, 1, 1, 0), (10, 1, 1, 0)):
            weight, bias = (states[f"features.{index}.{name}"].double().numpy() for name in ("weight", "bias"))
            image = _convolve(_pool(image) if pooled else image, weight, bias, stride, padding)
            maps.append(image / (np.sqrt((image**2).sum(0)) + 1e-10))
        features.append(maps)
    squares = [(a - b) ** 2 for a, b in zip(*features, strict=True)]
    return sum((h.double().numpy()[0] * s).sum(0).mean() for h, s in zip(heads, squares, strict=True))


def test_alex_equals_numpy(given):
    reference, test = pair()
    states = torch.load(given / "alexnet-features.pth", weights_only=True)
    expected = _alex_by_hand(states, weights.load_heads("alex"), reference, test)
    assert expected > 1e-3
    assert Lpips("alex", reference).value(test) == pytest.approx(expected, rel=1e-4)  # float32 sums of 3456 terms


@pytest.mark.parametrize("net", NETS)
@pytest.mark.filterwarnings("ignore:.*(pretrained|Arguments other than a weight enum):UserWarning")
def test_equals_the_published_package(given, net):
    """The package's own class around torchvision's network with the same weights, where torchvision loads."""
    lpips, models = _published()
    theirs = lpips.LPIPS(net=net, pnet_rand=True, verbose=False)
    states = torch.load(given / weights.TRUNK_FILES[net][-1], weights_only=True)
    slices = {key.split(".", 2)[1] + "." + key.split(".", 2)[2]: key for key in theirs.net.state_dict()}
    trunk = {key: states[f"features.{rest}"] for rest, key in slices.items()}
    theirs.net.load_state_dict(trunk)
    assert models is not None
    reference, test = pair((64, 70, 3))
    a, b = (torch.from_numpy(image.transpose(2, 0, 1))[None] for image in (reference, test))
    with torch.no_grad():
        expected = theirs(a, b, normalize=True).item()
    assert Lpips(net, reference).value(test) == pytest.approx(expected, rel=1e-5)  # float32, the same operations


def _published():
    torchvision_operators = torch.library.Library("torchvision", "FRAGMENT")
    for name in ("nms", "qnms"):  # a build of torchvision beside another build of torch lacks them
        if not hasattr(torch.ops.torchvision, name):
            torchvision_operators.define(f"{name}(Tensor dets, Tensor scores, float iou_threshold) -> Tensor")
    try:
        import lpips
        from torchvision import models
    except (ImportError, RuntimeError) as error:
        pytest.skip(f"torchvision does not load: {error}")
    return lpips, models


@pytest.mark.parametrize("net", NETS)
@pytest.mark.usefixtures("given")
def test_equal_pictures_have_no_distance_and_gradients_are_finite(net):
    reference, _ = pair((33, 35, 3))
    reference[:20] = 0  # flat areas, where features may all be 0
    lpips = Lpips(net, reference)
    value, gradient = lpips.value_and_gradient(reference)
    assert value == 0
    assert np.abs(gradient).max() == 0
    black = np.zeros_like(reference)
    assert np.isfinite(lpips.value_and_gradient(black)[1]).all()
    assert np.isfinite(Lpips(net, black).value_and_gradient(reference)[1]).all()


def test_features_that_are_all_zero_have_a_slope():
    features = torch.zeros(1, 4, 2, 2)
    features[0, :, 0, 0] = torch.tensor([3.0, 0.0, 4.0, 0.0])
    features.requires_grad_()
    unit = _unit(features)
    unit.sum().backward()
    assert unit[0, :, 0, 0].tolist() == pytest.approx([0.6, 0, 0.8, 0])
    assert unit[0, :, 1, 1].tolist() == [0, 0, 0, 0]
    assert torch.isfinite(features.grad).all()


@pytest.mark.usefixtures("given")
@pytest.mark.parametrize("name", [f"lpips_{net}-{end}" for net in NETS for end in ("ldr", "hdr")])
def test_as_a_loss(name):
    reference, image = pair((40, 40, 3))
    loss = make_loss(name, Image(reference, Encoding.LINEAR))
    value, gradient = loss.value_and_gradient(image)
    assert loss.name == name
    assert loss.value(reference) == 0
    assert value == pytest.approx(loss.value(image), rel=1e-5)
    slope = -float(np.square(gradient, dtype=np.float64).sum())
    step = 3e-3 * value / -slope
    lower = loss.value((image - step * gradient).astype(np.float32))
    # a step of 0.3 % of the loss: curvature and the rectifiers' kinks stay below a fifth of it
    assert lower - value == pytest.approx(step * slope, rel=0.2)


@pytest.mark.parametrize("net", NETS)
def test_absent_weights_are_named_and_never_invented(empty, net):
    with pytest.raises(SetupError, match=f"put torchvision's {weights.TRUNK_FILES[net][0]} into .*checkpoints, or"):
        Lpips(net, pair()[0])
    (empty / "hub" / "checkpoints").mkdir(parents=True)
    with pytest.raises(SetupError, match="not part of this program"):
        Lpips(net, pair()[0])


def test_the_cache_of_torch_is_searched_and_the_digest_checked(empty, files, monkeypatch):
    content = (files / "squeezenet1_1-features.pth").read_bytes()
    cache = empty / "hub" / "checkpoints"
    cache.mkdir(parents=True)
    (cache / "squeezenet1_1-b8a52dc0.pth").write_bytes(content)
    with pytest.raises(BadInputError, match=r"is damaged .its SHA-256 does not begin with b8a52dc0"):
        weights.load_trunk("squeeze")
    name = f"squeezenet1_1-{hashlib.sha256(content).hexdigest()[:8]}.pth"
    (cache / name).write_bytes(content)
    monkeypatch.setitem(weights.TRUNK_FILES, "squeeze", (name,))
    assert not any(value.requires_grad for value in weights.load_trunk("squeeze").parameters())


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "cannot be read as weights"),
        (b"not a file of torch", "cannot be read as weights"),
        ({"features.0.weight": [64, 3, 11, 11]}, "does not hold the weights of LPIPS's network 'alex'"),
        ({"features.0.weight": [1, 3, 3, 3], "features.0.bias": [1]}, "does not hold the weights"),
    ],
)
def test_another_file_is_refused(tmp_path, monkeypatch, content, sentence):
    path = tmp_path / "alexnet-features.pth"
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        torch.save({name: torch.zeros(shape) for name, shape in content.items()}, path)
    monkeypatch.setenv("MFO_LPIPS_WEIGHTS", str(tmp_path))
    with pytest.raises(BadInputError, match=sentence):
        weights.load_trunk("alex")


@pytest.mark.usefixtures("given")
@pytest.mark.parametrize("net", NETS)
def test_small_pictures_are_refused_from_the_networks_least_size_on(net):
    least = LEAST_SIZE[net]
    assert Lpips(net, np.ones((least, least, 3), np.float32)).value(np.zeros((least, least, 3), np.float32)) > 0
    with pytest.raises(BadInputError, match=f"at least {least}x{least} pixels, but the reference is {least}x1"):
        Lpips(net, np.ones((1, least, 3), np.float32))
    maps = Trunk(net)(torch.zeros(1, 3, least, least))
    assert [m.shape[1] for m in maps] == list(CHANNELS[net])


def test_the_heads_are_those_of_version_0_1():
    """First numbers of the package's files v0.1/*.pth, which are not negative; v0.0 holds others."""
    heads = {net: weights.load_heads(net) for net in NETS}
    assert [len(heads[net]) for net in NETS] == [5, 5, 7]
    assert all((head >= 0).all() for net in NETS for head in heads[net])


def test_without_the_package_its_name_is_given(monkeypatch):
    monkeypatch.setattr(weights.importlib.util, "find_spec", lambda _: None)
    with pytest.raises(SetupError, match='pip install "lpips=='):
        weights.load_heads("alex")


def test_pu_values_are_the_authors():
    """PU21(100) = 256.3839 and PU21(300) = 331.139 (check values of the encoding), over 255, clipped at 300."""
    values = PuValues(200.0).apply(np.array([-1.0, 0.5, 1.5, 9.0]))
    assert values == pytest.approx([0, 256.3839 / 255, 331.139 / 255, 331.139 / 255], abs=1e-5)
    x = np.array([0.01, 0.3, 1.2])
    numeric = (PuValues(200.0).apply(x + 1e-6) - PuValues(200.0).apply(x - 1e-6)) / 2e-6
    np.testing.assert_allclose(PuValues(200.0).slope(x), numeric, rtol=1e-6)
    assert (PuValues(200.0).slope(np.array([-1.0, 0.0, 9.0])) == [0, 0, 0]).all()


@pytest.mark.parametrize("variables", [{}, {"XDG_CACHE_HOME": "/x"}, {"TORCH_HOME": "/y"}, {"TORCH_HOME": "~/z"}])
def test_the_cache_is_where_torch_has_it(monkeypatch, variables):
    for name in ("TORCH_HOME", "XDG_CACHE_HOME", "MFO_LPIPS_WEIGHTS"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert weight_files.weight_folders() == [Path(torch.hub.get_dir()) / "checkpoints"]
