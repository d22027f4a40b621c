# SPDX-License-Identifier: Apache-2.0
"""What the add-on repeats of the backend, because it may not import it, is the same there."""

from __future__ import annotations

from types import SimpleNamespace

from blender_addon.process import job_process
from blender_addon.result import job_result
from mfo_backend.types.status import Status


def test_exit_codes_mean_the_same() -> None:
    assert set(job_process._EXIT_SENTENCES) == {0, *(s.exit_code for s in Status)}
    for code, status in job_process._EXIT_STATUS.items():
        assert Status(status).exit_code == code


def test_good_outcomes_are_those_with_exit_code_0(addon: object) -> None:
    from blender_addon.running import running_job

    assert {s.value for s in Status if s.exit_code == 0} == running_job._GOOD


def test_parameters_are_those_of_the_model(addon: object) -> None:
    from blender_addon import properties
    from mfo_backend.material import mitsuba_parameters as parameters

    assert {item[0] for item in properties.PARAMETER_ITEMS} == set(parameters.MITSUBA_PRINCIPLED.names)
    assert set(parameters.REDUCED) == properties.REDUCED


def test_sockets_are_those_of_the_model(addon: object) -> None:
    from blender_addon import properties
    from mfo_backend.material.principled.blender_selection import FIXED, REDUCED
    from mfo_backend.material.principled.principled_parameters import SOCKET_OF_PARAMETER

    fitted = [(name, socket) for name, socket in SOCKET_OF_PARAMETER.items() if name not in FIXED]
    assert sorted((item[0], item[1]) for item in properties.SOCKET_ITEMS) == sorted(fitted)
    assert set(REDUCED) == properties.SOCKETS_START


def test_schema_versions_agree(addon: object) -> None:
    from blender_addon.export import request as export
    from mfo_backend.job.folder import request
    from mfo_backend.job.output import result

    assert job_result.SCHEMA_VERSION == export.SCHEMA_VERSION == request.SCHEMA_VERSION == result.SCHEMA_VERSION


def test_backend_accepts_what_is_exported(scene: SimpleNamespace) -> None:
    from mfo_backend.job.folder import request
    from mfo_backend.job.folder.job_folder import JobFolder

    scene.bpy.ops.mfo.fit(reference=scene.reference, job_folder=scene.job, parameters="roughness", max_iterations=3)
    read = request.read_request(JobFolder.open(scene.job))
    assert (read.width, read.height, read.target.material) == (96, 64, "Glaze")
    assert (read.fit.parameters, read.fit.max_iterations) == (("roughness",), 3)
