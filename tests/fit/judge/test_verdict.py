# SPDX-License-Identifier: Apache-2.0
"""Verdicts and causes on pictures whose difference and noise are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from mfo_backend.fit.judge.beyond_noise import APART, NEXT, beyond_noise
from mfo_backend.fit.judge.verdict import difference_of, is_worse, judge
from mfo_backend.metrics.display.colour import srgb_from_linear
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.metrics.flip.ldr_flip import flip_map
from mfo_backend.types.image import Encoding, Image
from mfo_backend.types.verdict import Cause, Verdict

SIZE = 96
VIEW = DisplayView()
ROWS, COLUMNS = np.indices((SIZE, SIZE))
MASK = (ROWS - 48) ** 2 + (COLUMNS - 48) ** 2 < 26**2


def scene(*, ball=0.6, floor=0.3, right=0, red=1.0):
    """A shaded ball before a floor with stripes, (SIZE, SIZE, 3); moved `right` by so many pixels."""
    columns = COLUMNS - right
    shade = np.clip(1.0 - ((ROWS - 40) ** 2 + (columns - 42) ** 2) / 2500.0, 0.05, 1.0)
    stripes = floor * (1.0 + 0.4 * np.sin(0.3 * columns + 0.2 * ROWS))
    disc = (ROWS - 48) ** 2 + (columns - 48) ** 2 < 26**2
    grey = np.where(disc, ball * shade, stripes)
    return (grey[..., None] * (red, 1.0, 1.0)).astype(np.float32)


def noisy(picture, share, seed):
    """With noise that grows as the root of the light and has the tails of path tracing."""
    draw = np.random.default_rng(seed)
    return np.maximum(picture + share * np.sqrt(picture) * draw.standard_t(4, picture.shape), 0.0).astype(np.float32)


def verdict_of(reference, result, *, noted=False, encoding=Encoding.LINEAR):
    if encoding is Encoding.SRGB:
        reference = srgb_from_linear(np.clip(reference, 0.0, 1.0))
    found = judge(Image(reference, encoding), result, MASK, VIEW, noted=noted)
    assert found is not None
    return found


@pytest.mark.parametrize("encoding", list(Encoding))
@pytest.mark.parametrize("share", [0.0, 0.03, 0.12])
def test_noise_alone_looks_the_same(share, encoding):
    for seed in range(4):
        reference, result = noisy(scene(), share, seed), noisy(scene(), share / 2.0, 100 + seed)
        found = verdict_of(reference, result, encoding=encoding)
        assert (found.verdict, found.cause) == (Verdict.SAME, None), (seed, found)
        assert found.sentence == "The result looks the same as the reference."


@pytest.mark.parametrize("share", [0.0, 0.03, 0.08])
def test_the_larger_the_difference_the_worse_the_verdict(share):
    order = [Verdict.SAME, Verdict.CLOSE, Verdict.DIFFERENT]
    found = [verdict_of(noisy(scene(), share, 1), noisy(scene(ball=b), share, 2)).verdict for b in (0.6, 0.573, 0.3)]
    assert found == order


def test_what_neighbours_share_is_found_in_noise_of_any_size():
    """Of a difference of 0.05 in display values, under noise up to twice as large."""
    level = np.full((SIZE, SIZE, 3), 0.3)
    other = 0.3 - 0.05 * (srgb_from_linear(np.float32(0.3)) - srgb_from_linear(np.float32(0.2))) / 0.1
    apart = float(srgb_from_linear(np.float32(0.3)) - srgb_from_linear(np.float32(other)))
    for share in (0.0, 0.05, 0.1):
        found = beyond_noise(noisy(level, share, 1), noisy(np.full_like(level, other), share, 2), MASK)
        assert found.shared == pytest.approx(apart, rel=0.02 + 2.0 * share)
        assert found.shared_at_least <= found.shared


@pytest.mark.parametrize("lags", [APART, NEXT], ids=["apart", "next"])
def test_pictures_that_are_mirrored_share_as_much(lags):
    """Of a difference in stripes along one diagonal."""
    reference = scene()
    result = reference * (1.0 + 0.3 * ((ROWS + COLUMNS) % 7 < 2))[..., None]
    found = beyond_noise(reference, result, MASK, lags)
    mirrored = beyond_noise(reference[:, ::-1], result[:, ::-1], MASK[:, ::-1], lags)
    assert mirrored.shared == pytest.approx(found.shared, rel=1e-3)
    assert mirrored.fine_at_least == pytest.approx(found.fine_at_least, rel=1e-3)


def of_few_samples(picture, samples, seed):
    """The mean of samples that seldom meet the light: most pixels are too dark, a few far too bright."""
    paths = np.random.default_rng(seed).gamma(0.25 * samples, 4.0 / samples, picture.shape[:2])
    return (picture * paths[..., None]).astype(np.float32)


def test_noise_that_a_display_darkens_is_no_difference():
    """A display shows noisy pixels darker: a true result looked too bright, one too dark by a fifth right."""
    same, darker = (
        [
            beyond_noise(of_few_samples(scene(), 8, k), of_few_samples(level * scene(), 64, 100 + k), MASK)
            for k in range(6)
        ]
        for level in (1.0, 0.8)
    )
    assert max(difference.shared_at_least for difference in same) < 0.01
    assert min(difference.shared_at_least for difference in darker) > 0.03


def flickering(picture, seed):
    """With noise of one colour whose tails are heavier than those of any variance."""
    tails = np.random.default_rng(seed).standard_t(2.2, picture.shape[:2])
    return np.maximum(picture * (1.0 + 0.08 * tails[..., None]), 0.0).astype(np.float64)


@pytest.mark.parametrize("radius", [8, 12])
def test_few_pixels_hide_no_difference_in_the_tails_of_noise(radius):
    """On 190 to 440 pixels, by the pictures without noise: what they differ in by FLIP, and that two are the same."""
    mask = np.hypot(ROWS - 48, COLUMNS - 48) < radius
    calm, other = (gaussian_filter(scene(ball=ball), (2, 2, 0)) for ball in (0.6, 0.55))
    apart = flip_map(srgb_from_linear(calm), srgb_from_linear(other))[mask].mean()
    visible = {
        ball: [
            beyond_noise(flickering(scene(), k), flickering(scene(ball=ball), 100 + k), mask).visible for k in range(6)
        ]
        for ball in (0.6, 0.55)
    }
    assert np.mean(visible[0.6]) < 0.01
    assert np.min(visible[0.55]) > 0.025
    assert 0.4 * apart < np.mean(visible[0.55]) < apart


@pytest.mark.parametrize(("radius", "share", "hides"), [(9, 0.06, True), (9, 0.01, False), (26, 0.15, False)])
def test_few_noisy_pixels_are_said_to_hide_fine_differences(radius, share, hides):
    mask = np.hypot(ROWS - 48, COLUMNS - 48) < radius
    reference, result = noisy(scene(), share, 1), noisy(scene(), share / 2.0, 2)
    found = judge(Image(reference, Encoding.LINEAR), result, mask, VIEW)
    assert found is not None
    assert found.verdict is Verdict.SAME
    assert found.may_hide is hides
    assert found.sentence.endswith("a larger or cleaner picture tells more.") is hides


@pytest.mark.parametrize(
    ("radius", "share", "verdict"), [(5, 0.3, Verdict.CLOSE), (5, 0.02, Verdict.SAME), (26, 0.15, Verdict.SAME)]
)
def test_a_target_whose_noise_hides_any_difference_is_not_called_the_same(radius, share, verdict):
    """On 81 pixels, and on 2,120 of as much noise, whose mean tells."""
    mask = np.hypot(ROWS - 48, COLUMNS - 48) < radius
    for k in range(4):
        reference, result = noisy(scene(), share, k), noisy(scene(), share / 2.0, 50 + k)
        found = judge(Image(reference, Encoding.LINEAR), result, mask, VIEW)
        assert found is not None
        assert found.verdict is verdict
        assert found.cause is (None if verdict is Verdict.SAME else Cause.NOISE)


def test_few_pixels_have_no_verdict():
    mask = np.zeros_like(MASK)
    mask[10:14, 10:14] = True
    assert judge(Image(scene(), Encoding.LINEAR), scene(), mask, VIEW) is None


@pytest.mark.parametrize(
    ("reference", "result", "cause"),
    [
        (scene(right=3), scene(), Cause.CAMERA_OR_SHAPE),
        (scene(ball=0.9, floor=0.45), scene(), Cause.LIGHT),
        (scene(red=1.6), scene(red=1.0), Cause.LIGHT),
        (np.where(MASK[..., None], scene(ball=0.2), scene()), scene(), Cause.MATERIAL),
        (np.where((COLUMNS > 78)[..., None], scene() * 0.2, scene()), scene(), Cause.SURROUNDINGS),
        (np.where((COLUMNS > 78)[..., None], scene() * 0.2, scene(ball=0.4)), scene(), Cause.LIGHT),
        (np.random.default_rng(0).uniform(0, 1, (SIZE, SIZE, 3)), scene(), Cause.PICTURE),
    ],
    ids=["camera", "light", "tinted light", "material", "object beside it", "light of both", "another picture"],
)
def test_the_cause_is_where_the_pictures_differ(reference, result, cause):
    if cause is Cause.PICTURE:
        reference = gaussian_filter(reference, (6, 6, 0)) * 4.0 - 1.5
        reference = np.clip(reference, 0.0, 1.0)
    found = verdict_of(noisy(reference.astype(np.float32), 0.03, 1), noisy(result, 0.02, 2))
    assert found.verdict is not Verdict.SAME
    assert found.cause is cause
    assert found.sentence == f"{found.verdict.sentence} {cause.sentence}"


def test_a_fine_pattern_is_found_whose_products_change_their_sign():
    checks = np.where((ROWS // 2 + COLUMNS // 2) % 2 == 0, 1.0, 0.6)
    reference = np.where(MASK[..., None], scene() * checks[..., None], scene())
    found = verdict_of(noisy(reference.astype(np.float32), 0.03, 1), noisy(scene(ball=0.48), 0.03, 2))
    assert found.verdict is not Verdict.SAME
    assert found.target.fine_at_least > 0.035


def test_a_note_of_the_export_is_named_where_nothing_else_is():
    reference = np.where(MASK[..., None], scene(ball=0.2), scene())
    assert verdict_of(reference, scene(), noted=True).cause is Cause.NOTED


def test_a_result_that_fits_under_another_light_is_not_the_same():
    """The material makes up for the light on the target: the surroundings tell."""
    reference = np.where(MASK[..., None], scene(), scene(floor=0.5))
    found = verdict_of(noisy(reference, 0.03, 1), noisy(scene(), 0.03, 2))
    assert (found.verdict, found.cause) == (Verdict.CLOSE, Cause.LIGHT)


def test_a_background_that_was_cut_out_says_nothing():
    reference = np.where(MASK[..., None], scene(), 1.0).astype(np.float32)
    found = verdict_of(noisy(reference, 0.0, 1), noisy(scene(), 0.03, 2))
    assert found.verdict is Verdict.SAME
    assert found.around is None


def test_worse_than_the_start_is_what_looks_farther_from_the_reference():
    reference = Image(noisy(scene(), 0.1, 0), Encoding.LINEAR)
    near, far = noisy(scene(ball=0.58), 0.05, 1), noisy(scene(ball=0.4), 0.05, 2)

    def worse(start, result):
        return is_worse(reference, start, difference_of(reference, result, MASK, VIEW), MASK, VIEW)

    assert worse(near, far)
    assert not worse(far, near)
    assert not worse(near, noisy(scene(ball=0.58), 0.15, 3))
    assert difference_of(reference, far, MASK, VIEW) == judge(reference, far, MASK, VIEW).target


def test_what_does_not_count_has_no_part_in_the_verdict():
    occluded = np.where((COLUMNS > 50)[..., None], np.float32(0.9), scene())
    assert verdict_of(occluded, scene()).verdict is Verdict.DIFFERENT
    counts = COLUMNS <= 50
    found = judge(Image(occluded, Encoding.LINEAR, counts=counts), scene(), MASK & counts, VIEW)
    assert found is not None
    assert found.verdict is Verdict.SAME
    assert found.around is not None  # what counts beside the target is still looked at
