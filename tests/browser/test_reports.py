"""Report pages in a browser: they open from disk, draw, play, scrub, and show the positions and numbers of the run."""

from __future__ import annotations

import numpy as np
import pytest

from qlb.results import Run
from tests.browser.pages import body_pixels

pytestmark = pytest.mark.slow


def test_a_report_opens_from_disk_and_draws_the_body(open_page, bar):
    page = open_page(bar / "report.html")
    assert page.requests == [(bar / "report.html").resolve().as_uri()]
    assert page.page.inner_text(".verdict") == "Converged: all 12 steps."
    pixels = page.pixels()
    assert 0.01 < body_pixels(pixels).mean() < 0.5
    ids = page.page.eval_on_selector_all("#plots-root section", "(all) => all.map((one) => one.id)")
    assert ids == ["iterations", "residuals", "seconds", "energy", "momentum", "angular-momentum"]
    assert page.page.locator("#plots-root svg.main-svg").count() >= len(ids)


def test_decoded_positions_are_those_of_the_run(open_page, bar):
    page = open_page(bar / "report.html")
    run = Run(bar)
    frames = page.page.evaluate(
        "() => document.getElementById('viewer-root').animations[0].frames"
        ".map((frame) => [frame.step, frame.time, [...frame.positions]])"
    )
    assert [frame[0] for frame in frames] == run.frame_steps
    surface = run.mesh.rendered()
    assert [frame[1] for frame in frames] == [frame.time for frame in run.frames()]
    everything = np.stack([surface.of_nodes(frame.positions) for frame in run.frames()])
    half_a_step = 0.5 * np.ptp(everything, axis=(0, 1)) / 65535
    for (_, _, positions), expected in zip(frames, everything, strict=True):
        off = np.abs(np.reshape(positions, (-1, 3)) - expected)
        assert (off <= 1.01 * half_a_step + 1e-7).all()  # single precision in the browser


def test_keys_and_the_slider_step_through_the_frames(open_page, bar):
    page = open_page(bar / "report.html")
    assert page.step == 0
    start = page.pixels()
    page.press("End", 12)
    end = page.pixels()
    assert np.abs(end - start).mean() > 1
    page.press("ArrowLeft", 11)
    page.press("ArrowRight", 12)
    np.testing.assert_array_equal(page.pixels(), end)
    page.page.locator("input[type=range]").fill("5")
    page.wait_for_step(5)
    assert page.page.inner_text(".readout") == "step 5, t = 0.05 s"
    page.press("Home", 0)
    np.testing.assert_array_equal(page.pixels(), start)


def test_playing_goes_on_and_stops(open_page, bar):
    page = open_page(bar / "report.html")
    page.page.click("button[aria-label=Play]")
    page.wait_for("() => Number(document.getElementById('viewer-root').dataset.step) >= 3")
    page.page.click("button[aria-label=Pause]")
    page.page.wait_for_selector("button[aria-label=Play]")
    step = page.step
    page.pixels()
    assert page.step == step


def test_colours_follow_the_field(open_page, bar):
    page = open_page(bar / "report.html")
    page.press("End", 12)
    names = page.page.eval_on_selector_all("#colour-by option", "(all) => all.map((one) => one.value)")
    assert names == ["displacement", "speed", "energy_density", "von_mises"]
    shown = []
    for name, unit in (("displacement", "m"), ("speed", "m/s"), ("von_mises", "Pa")):
        page.page.select_option("#colour-by", name)
        assert page.page.inner_text(".ticks b").endswith(unit)
        shown.append(page.pixels())
    assert np.abs(shown[0] - shown[2])[body_pixels(shown[0])].mean() > 5
    largest = max(run_values(bar, lambda snapshot: snapshot.at_surface(snapshot.von_mises_stress).max()))
    title = page.page.get_attribute(".scale", "title")
    number, unit = title.split("at most ")[1].split()[:2]
    assert float(number) * {"Pa": 1, "kPa": 1e3}[unit] == pytest.approx(largest, rel=0.006)


def run_values(directory, value):
    run = Run(directory)
    return [value(run.snapshot(frame)) for frame in run.frames()]


def test_the_view_turns_and_comes_back(open_page, bar):
    page = open_page(bar / "report.html")
    before = page.pixels()
    box = page.page.locator(".stage").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    page.page.mouse.move(x + 150, y + 40, steps=4)
    page.page.mouse.up()
    assert np.abs(page.pixels() - before).mean() > 1
    page.page.click("button[aria-label='Reset view']")
    assert np.abs(page.pixels() - before).mean() < 0.5
    page.page.click("button[aria-label='Mesh edges']")
    assert np.abs(page.pixels() - before).mean() > 0.1


def test_a_bunny_on_the_ground(open_page, bunny):
    page = open_page(bunny / "report.html", scheme="dark")
    sections = page.page.locator("#plots-root section")
    assert "contact" in sections.evaluate_all("(all) => all.map((one) => one.id)")
    page.press("End", 8)
    page.page.select_option("#colour-by", "contact_force")
    assert page.page.inner_text(".ticks b").endswith("N")
    pixels = page.pixels()
    assert 0.05 < body_pixels(pixels).mean() < 0.6
    assert np.ptp(pixels[~body_pixels(pixels)], axis=0).max() > 20  # ground beside the background


def test_a_comparison_shares_one_clock(open_page, comparison):
    page = open_page(comparison)
    assert page.page.locator(".view figcaption").all_inner_texts() == ["ND", "QLB", "QLA"]
    before = [page.pixels(view) for view in range(3)]
    assert all(body_pixels(pixels).mean() > 0.01 for pixels in before)
    page.press("End", 12)
    after = [page.pixels(view) for view in range(3)]
    for one, other in zip(before, after, strict=True):
        assert np.abs(other - one).mean() > 0.5
    np.testing.assert_allclose(after[0], after[2], atol=12)  # the same motion from the same camera


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_nothing_sticks_out_of_the_window(open_page, bunny, width, scheme):
    page = open_page(bunny / "report.html", width=width, scheme=scheme)
    assert page.page.evaluate("document.documentElement.scrollWidth") <= width
    background = page.page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (min(map(int, background[4:-1].split(","))) > 128) == (scheme == "light")
    for plot in page.page.locator(".plot").all():
        assert plot.bounding_box()["width"] <= width


def test_a_click_at_a_step_of_a_plot_shows_it(open_page, bar):
    page = open_page(bar / "report.html")
    page.page.evaluate("document.dispatchEvent(new CustomEvent('qlb:step', { detail: 7 }))")
    page.wait_for_step(7)
