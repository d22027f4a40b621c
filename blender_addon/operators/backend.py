# SPDX-License-Identifier: GPL-3.0-or-later
"""`mfo.install_backend`, `mfo.cancel_install`, `mfo.test_backend`, `mfo.remove_backend`, `mfo.open_install_log`."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

from pathlib import Path

import bpy
from bpy.props import BoolProperty, StringProperty

from ..backend import backend_state
from ..backend.preferences import preference
from ..running import running_job
from ..sentences.translated import translated

_SCRIPT = {"HIDDEN", "SKIP_SAVE"}


class MFO_OT_install_backend(bpy.types.Operator):
    """Make a Python environment of its own for the backend, outside Blender's Python, and install Mitsuba into it"""

    bl_idname = "mfo.install_backend"
    bl_label = "Install Backend"
    bl_options = {"REGISTER"}

    python: StringProperty(
        name="Python", description="What to build on; empty: the preference, else one is looked for", options=_SCRIPT
    )
    wheels: StringProperty(
        name="Wheels", description="Folder to install from without network; empty: the preference", options=_SCRIPT
    )
    wait: BoolProperty(
        name="Wait", description="Return when it has ended; always so by default in background", options=_SCRIPT
    )

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Refused while it runs already, or while a fit may be using the environment."""
        if backend_state.is_installing():
            cls.poll_message_set(translated("The backend is being installed"))
            return False
        if running_job.current is not None:
            cls.poll_message_set(translated("A fit is running; cancel it first"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Start it; wait for it in background mode."""
        wheels = bpy.path.abspath(self.wheels or preference(context, "wheels"))
        refusal = _why_not(wheels)
        if refusal:
            self.report({"ERROR"}, translated(refusal))
            return {"CANCELLED"}
        python = bpy.path.abspath(self.python or preference(context, "base_python"))
        backend_state.start_install(python, wheels)
        if not (self.wait or (bpy.app.background and not self.properties.is_property_set("wait"))):
            return {"FINISHED"}
        outcome = backend_state.wait(lambda line: print(f"Material Fit: {line}", flush=True))
        state = backend_state.current
        if outcome is not None and outcome.status == "cancelled":
            self.report({"WARNING"}, translated(outcome.sentence))
            return {"CANCELLED"}
        if state.name != "READY":
            self.report({"ERROR"}, translated(" ".join([state.sentence, *state.problems])))
            return {"CANCELLED"}
        self.report({"INFO"}, translated(f"The backend is ready: {state.sentence}"))
        return {"FINISHED"}


class MFO_OT_cancel_install(bpy.types.Operator):
    """Stop the installation and remove what it has made so far"""

    bl_idname = "mfo.cancel_install"
    bl_label = "Cancel Installation"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Only while it runs and was not cancelled yet."""
        if not backend_state.is_installing():
            cls.poll_message_set(translated("Nothing is being installed"))
            return False
        if backend_state.is_cancelling():
            cls.poll_message_set(translated("The installation is being cancelled"))
            return False
        return True

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Ask it to stop; the timer sees it end."""
        backend_state.cancel_install()
        return {"FINISHED"}


class MFO_OT_test_backend(bpy.types.Operator):
    """Ask the backend's Python again whether it can run a fit"""

    bl_idname = "mfo.test_backend"
    bl_label = "Test Backend"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Not while it is being installed."""
        if backend_state.is_installing():
            cls.poll_message_set(translated("The backend is being installed"))
            return False
        return True

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Start the test; wait for it in background mode."""
        backend_state.look(test=False)
        state = backend_state.current
        if state.python:
            backend_state.start_test()
        if bpy.app.background:
            backend_state.wait(lambda _line: None)
        sentence = " ".join([state.sentence, *state.problems])
        if state.name in {"BROKEN", "NOT_INSTALLED"}:
            self.report({"ERROR"}, translated(sentence))
            return {"CANCELLED"}
        self.report({"INFO"}, translated(sentence))
        return {"FINISHED"}


class MFO_OT_remove_backend(bpy.types.Operator):
    """Delete the environment that Install made; a Python of your own is never touched"""

    bl_idname = "mfo.remove_backend"
    bl_label = "Remove Backend"
    bl_options = {"REGISTER"}

    poll = MFO_OT_install_backend.poll

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Ask first."""
        return context.window_manager.invoke_confirm(self, event)

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Delete the folder."""
        left = backend_state.remove()
        if left:
            self.report(
                {"ERROR"}, translated(f"{left[0]} cannot be deleted: close what uses it and remove the backend again.")
            )
            return {"CANCELLED"}
        self.report({"INFO"}, translated("The backend was removed."))
        return {"FINISHED"}


class MFO_OT_open_install_log(bpy.types.Operator):
    """Open the log of the last installation"""

    bl_idname = "mfo.open_install_log"
    bl_label = "Open Installation Log"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Only where there is one."""
        if not backend_state.current.log_file:
            cls.poll_message_set(translated("Nothing was installed yet"))
            return False
        return True

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Hand it to the system's editor."""
        log = Path(backend_state.current.log_file)
        if not log.is_file():
            self.report({"ERROR"}, translated(f"{log} is gone: install the backend again."))
            return {"CANCELLED"}
        bpy.ops.wm.path_open(filepath=str(log))
        return {"FINISHED"}


def _why_not(wheels: str) -> str:
    """One sentence where installing is refused before it starts, else empty."""
    if wheels:
        folder = Path(wheels)
        if not folder.is_dir() or not any(folder.glob("*.whl")):
            return f"{wheels} holds no wheels (*.whl): choose the folder they were downloaded to."
        return ""
    if bpy.app.online_access:
        return ""
    if bpy.app.online_access_override:
        return (
            "Blender was started with --offline-mode: start it without, or install from a folder of wheels (add-on "
            "preferences, Wheels)."
        )
    return (
        "Blender may not go online: turn on Preferences > System > Network > Allow Online Access, or install from a "
        "folder of wheels (add-on preferences, Wheels)."
    )


CLASSES = (
    MFO_OT_install_backend,
    MFO_OT_cancel_install,
    MFO_OT_test_backend,
    MFO_OT_remove_backend,
    MFO_OT_open_install_log,
)
