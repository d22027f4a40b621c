# SPDX-License-Identifier: Apache-2.0
"""Finding a libLLVM that works, and surviving those that do not."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from pathlib import Path

import pytest

from mfo_backend.render.machine import llvm, llvm_candidates
from mfo_backend.render.machine.cache_folder import cache_folder
from mfo_backend.types.errors import SetupError

INSTALLED = {
    version: path
    for version, path in ((v, Path(f"/usr/lib/x86_64-linux-gnu/libLLVM-{v}.so")) for v in (14, 15, 19))
    if path.exists()
}


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("MFO_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", "")  # so that what a test leaves there is taken back
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH")
    return tmp_path / "cache"


@pytest.fixture
def no_child(monkeypatch: pytest.MonkeyPatch):
    def refuse(path, timeout):
        raise AssertionError("no child process is needed")

    return lambda: monkeypatch.setattr(llvm, "_probe_in_child", refuse)


@pytest.mark.parametrize(
    ("name", "version"),
    [
        ("libLLVM-15.so", (15,)),
        ("libLLVM-14.0.6.so.1", (14, 0, 6)),
        ("libLLVM.so.19.1", (19, 1)),
        ("llvm-18/lib/libLLVM.so", (18,)),
        ("Cellar/llvm/19.1.7_1/lib/libLLVM.dylib", (19, 1, 7)),
        ("opt/llvm@16/lib/libLLVM.dylib", (16,)),
        ("LLVM/bin/LLVM-C.dll", (0,)),
    ],
)
def test_the_version_that_a_path_tells(tmp_path: Path, name: str, version: tuple[int, ...]) -> None:
    assert llvm_candidates.llvm_version(Path("/nowhere") / name) == version


def test_the_highest_version_comes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "conda" / "lib"
    folder.mkdir(parents=True)
    for name in ("libLLVM-9.so", "libLLVM.so.19.1", "libLLVM-15.so", "libLLVMCore.so.19", "libLLVM.a", "libLLVM.py"):
        (folder / name).write_bytes(b"")
    (folder / "libLLVM-19.so").symlink_to("libLLVM.so.19.1")
    monkeypatch.setenv("CONDA_PREFIX", str(tmp_path / "conda"))
    monkeypatch.setattr(llvm_candidates, "_FOLDERS", {})
    monkeypatch.setenv("PATH", "")
    found = [path for path in llvm_candidates.llvm_candidates() if path.is_relative_to(tmp_path)]
    assert [path.resolve().name for path in found] == ["libLLVM.so.19.1", "libLLVM-15.so", "libLLVM-9.so"]


def test_the_user_s_choice_comes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(tmp_path / "mine.so"))
    assert llvm_candidates.llvm_candidates()[0] == tmp_path / "mine.so"


@pytest.mark.skipif(14 not in INSTALLED, reason="LLVM 14 is not installed")
def test_llvm_14_is_too_old() -> None:
    verdict = llvm.probe_llvm(INSTALLED[14])
    assert not verdict.works
    assert "version (14) is too old" in verdict.reason


@pytest.mark.skipif(15 not in INSTALLED, reason="LLVM 15 is not installed")
def test_llvm_15_cannot_end_this_process() -> None:
    # it aborts on processors with AVX-512 at least; what counts is that a child finds out
    verdict = llvm.probe_llvm(INSTALLED[15])
    assert verdict.works or verdict.reason.startswith("LLVM ERROR: Cannot select"), verdict


@pytest.mark.skipif(19 not in INSTALLED, reason="LLVM 19 is not installed")
def test_llvm_19_is_found_behind_a_bad_choice(monkeypatch: pytest.MonkeyPatch, no_child) -> None:
    bad = next((INSTALLED[v] for v in (15, 14) if v in INSTALLED), Path("/nowhere/libLLVM.so"))
    monkeypatch.setattr(llvm, "llvm_candidates", lambda: [bad, INSTALLED[19]])
    if llvm.probe_llvm(bad).works:
        pytest.skip("LLVM 15 works on this processor")
    assert llvm.configure_llvm() == INSTALLED[19]
    assert os.environ["DRJIT_LIBLLVM_PATH"] == str(INSTALLED[19])
    no_child()  # from now on both verdicts are remembered
    assert llvm.configure_llvm() == INSTALLED[19]


@pytest.mark.skipif(19 not in INSTALLED, reason="LLVM 19 is not installed")
def test_a_probe_compiles_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # kernels that another LLVM left in the user's cache would let a broken one pass
    (tmp_path / "kernels").mkdir()
    monkeypatch.setenv("DRJIT_CACHE_DIR", str(tmp_path / "kernels"))
    assert llvm.probe_llvm(INSTALLED[19]).works
    assert list((tmp_path / "kernels").iterdir()) == []


def test_a_file_that_is_no_library(tmp_path: Path) -> None:
    fake = tmp_path / "libLLVM-99.so"
    fake.write_bytes(b"not a library")
    verdict = llvm.probe_llvm(fake)
    assert not verdict.works
    assert verdict.reason
    assert "\n" not in verdict.reason


def test_a_verdict_holds_until_the_file_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library = tmp_path / "libLLVM-20.so"
    library.write_bytes(b"")
    calls = []

    def probe(path: Path, timeout: float) -> llvm.LlvmVerdict:
        calls.append(path)
        return llvm.LlvmVerdict(str(path), True, "compiled and ran a kernel")

    monkeypatch.setattr(llvm, "_probe_in_child", probe)
    first = llvm.probe_llvm(library)
    assert llvm.probe_llvm(library) == first
    assert len(calls) == 1
    os.utime(library, (1, 1))
    llvm.probe_llvm(library)
    assert len(calls) == 2
    monkeypatch.setattr(llvm, "_version", lambda package: "4.0")
    llvm.probe_llvm(library)
    assert len(calls) == 3


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"works": true}'])
def test_a_damaged_verdict_is_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: str) -> None:
    fresh = llvm.LlvmVerdict(str(tmp_path / "a.so"), True, "fresh")
    monkeypatch.setattr(llvm, "_probe_in_child", lambda path, timeout: fresh)
    llvm.probe_llvm(tmp_path / "a.so")
    (kept,) = (cache_folder() / "llvm").iterdir()
    kept.write_text(content)
    assert llvm.probe_llvm(tmp_path / "a.so") == fresh


def test_a_probe_without_an_answer_is_not_remembered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(llvm, "_probe_in_child", lambda path, timeout: None)
    verdict = llvm.probe_llvm(tmp_path / "a.so", timeout=7)
    assert not verdict.works
    assert verdict.reason == "gave no answer within 7 seconds"
    assert not cache_folder().exists()


def test_a_cache_that_cannot_be_written_is_no_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("MFO_CACHE_DIR", str(tmp_path / "file" / "below"))
    works = llvm.LlvmVerdict("a", True, "")
    monkeypatch.setattr(llvm, "_probe_in_child", lambda path, timeout: works)
    assert llvm.probe_llvm(tmp_path / "a.so") == works


@pytest.mark.parametrize(
    ("system", "cure"), [("linux", "apt install libllvm19"), ("darwin", "brew install llvm"), ("win32", "LLVM-C.dll")]
)
def test_without_llvm_the_cure_is_named(monkeypatch: pytest.MonkeyPatch, system: str, cure: str) -> None:
    monkeypatch.setattr(llvm, "llvm_candidates", list)
    monkeypatch.setattr(sys, "platform", system)
    with pytest.raises(SetupError, match="No LLVM library was found: ") as caught:
        llvm.configure_llvm()
    assert cure in str(caught.value)
    assert str(caught.value).endswith(".")


def test_what_was_tried_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(llvm, "llvm_candidates", lambda: [Path("/x/libLLVM-15.so")])
    verdict = llvm.LlvmVerdict("/x/libLLVM-15.so", False, "LLVM ERROR: Cannot select")
    monkeypatch.setattr(llvm, "_probe_in_child", lambda path, timeout: verdict)
    with pytest.raises(SetupError, match=r"tried /x/libLLVM-15\.so: LLVM ERROR: Cannot select"):
        llvm.configure_llvm()


def test_a_missing_system_library_is_named_and_not_remembered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stderr = "ImportError: libatomic.so.1: cannot open shared object file: No such file\nNameError: name '_drjit_ext'"
    monkeypatch.setattr(llvm, "llvm_candidates", lambda: [tmp_path / "libLLVM-19.so"])
    verdict = llvm.LlvmVerdict("libLLVM-19.so", False, llvm._reason(stderr, 1))
    monkeypatch.setattr(llvm, "_probe_in_child", lambda path, timeout: verdict)
    with pytest.raises(SetupError, match=r"needs the system library libatomic\.so\.1.*apt install libatomic1"):
        llvm.configure_llvm()
    works = llvm.LlvmVerdict("libLLVM-19.so", True, "")
    monkeypatch.setattr(llvm, "_probe_in_child", lambda path, timeout: works)
    assert llvm.configure_llvm() == tmp_path / "libLLVM-19.so"


def test_a_library_is_not_blamed_for_a_want_of_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library = tmp_path / "libLLVM-19.so"
    library.touch()
    for reason, works in (("LLVM ERROR: out of memory", False), ("compiled and ran a kernel", True)):
        verdict = llvm.LlvmVerdict(str(library), works, reason)
        monkeypatch.setattr(llvm, "_probe_in_child", lambda path, timeout, verdict=verdict: verdict)
        assert llvm.probe_llvm(library).works is works


def test_without_mitsuba_llvm_is_not_blamed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(llvm.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(SetupError, match="mitsuba and drjit are not installed in") as caught:
        llvm.configure_llvm()
    assert "-m pip install mitsuba==3.9.1" in str(caught.value)


def test_the_probe_leaves_no_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    llvm.probe_llvm(tmp_path / "missing.so")
    shutil.rmtree(tmp_path / "cache", ignore_errors=True)
    assert list(tmp_path.iterdir()) == []
