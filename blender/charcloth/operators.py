"""What the buttons do: burn, go on, cancel, load, add a spark."""

import atexit
from pathlib import Path

import bpy
from bpy.app.handlers import persistent

from . import loader
from .job import Job, Step
from .preferences import find_program, thread_arguments
from .properties import sheet_of
from .scene_file import last_frame, override_arguments, run_folder, wants_flames, write_scene

INTERVAL = 0.25  # [s] between two looks at a job
SPARKS = "Sparks"

# Jobs by the name of their sheet. Settings of a sheet show what a job reports; the job itself is not saved.
jobs: dict[str, Job] = {}


def can_resume(sheet: bpy.types.Object) -> bool:
    """Whether there is a run to go on with."""
    try:
        return (run_folder(sheet) / "run" / "cache" / "checkpoint.npz").is_file()
    except ValueError:
        return False


def start(sheet: bpy.types.Object, scene: bpy.types.Scene, resume: bool) -> Job:
    """Writes what the program reads and starts it: simulation, then export."""
    program = find_program()
    if program is None:
        raise ValueError("the charcloth program was not found; name it in the preferences of the add-on")
    if sheet.name in jobs:
        raise ValueError(f'"{sheet.name}" burns already')
    folder = run_folder(sheet)
    run = str(folder / "run")
    json = ["--progress", "json"]
    if resume:
        what = ["--resume", run, "--frames", str(last_frame(sheet.charcloth))]
    else:
        path = write_scene(sheet, scene)
        what = [str(path), "-o", run, "--force", *override_arguments(sheet.charcloth)]
    simulate = [program, "run", *what, "--no-movie", *thread_arguments(), *json]
    steps = [Step("burning", simulate), Step("exporting", _export(folder, "usd", ["--mean-velocities"]))]
    if wants_flames(sheet.charcloth):
        voxel = f"{sheet.charcloth.voxel:.7g}"
        steps.append(Step("exporting flames", _export(folder, "vdb", ["--voxel", voxel])))
    job = Job(steps)
    jobs[sheet.name] = job
    return job


def _export(folder: Path, form: str, options: list[str]) -> list[str]:
    """The command that exports the run of a folder."""
    # The folder is the add-on's own: what an older version left there is in nobody's way.
    into = ["-o", str(folder / form), "--force", "--progress", "json"]
    return [find_program(), "export", str(folder / "run"), "--format", form, *options, *into]


def show(sheet: bpy.types.Object, job: Job) -> None:
    """Notes how far a job is where the panel looks."""
    settings = sheet.charcloth
    settings.state = "" if job.done else job.label
    settings.progress = job.progress
    if job.error:
        settings.message = job.error
    elif job.stopped:
        settings.message = "stopped; Resume goes on with it"
    else:
        left = f", {job.left:.0f} s left" if job.left is not None and not job.done else ""
        place = f"frame {job.frame}{left}" if job.label == "burning" and job.frame is not None else ""
        settings.message = "\n".join([place, *(f"warning: {text}" for text in job.warnings)]).strip()


def conclude(sheet: bpy.types.Object, scene: bpy.types.Scene, job: Job) -> str:
    """Takes a finished job away and loads what it made; returns what went wrong."""
    jobs.pop(sheet.name, None)
    show(sheet, job)
    if job.error or job.stopped:
        return job.error
    try:
        loader.load(sheet, scene)
    except (ValueError, RuntimeError) as error:
        sheet.charcloth.message = str(error)
        return str(error)
    return ""


class _Sheet(bpy.types.Operator):
    """What acts on the active mesh."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There must be a mesh."""
        return sheet_of(context) is not None

    def fail(self, sheet: bpy.types.Object, error: Exception | str) -> set[str]:
        """Says what went wrong, in the panel and as Blender does."""
        sheet.charcloth.message = str(error)
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}


class _Burning(_Sheet):
    """What runs the program."""

    resume = False

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Starts; without a window, goes on to the end."""
        sheet = sheet_of(context)
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        try:
            self._job = start(sheet, context.scene, self.resume)
        except (ValueError, OSError) as error:
            return self.fail(sheet, error)
        sheet.charcloth.message = ""
        # By name: an undo meanwhile makes other objects of the same names.
        self._names = (sheet.name, context.scene.name)
        if bpy.app.background or context.window is None:
            self._job.wait()
            return self._finish(sheet, context.scene)
        show(sheet, self._job)
        self._timer = context.window_manager.event_timer_add(INTERVAL, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Looks at the job when the timer says so; all other events are left to Blender."""
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        over = self._job.poll()
        sheet, scene = bpy.data.objects.get(self._names[0]), bpy.data.scenes.get(self._names[1])
        if sheet is None or scene is None:  # deleted, or renamed
            self._job.stop()
            jobs.pop(self._names[0], None)
            context.window_manager.event_timer_remove(self._timer)
            return {"CANCELLED"}
        show(sheet, self._job)
        for area in context.screen.areas if context.screen else []:
            if area.type == "PROPERTIES":
                area.tag_redraw()
        if not over:
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self._timer)
        return self._finish(sheet, scene)

    def _finish(self, sheet: bpy.types.Object, scene: bpy.types.Scene) -> set[str]:
        error = conclude(sheet, scene, self._job)
        if error:
            return self.fail(sheet, error)
        return {"CANCELLED"} if self._job.stopped else {"FINISHED"}


class Burn(_Burning):
    """Burns the sheet in the background and loads the result"""

    bl_idname = "charcloth.burn"
    bl_label = "Burn"


class Resume(_Burning):
    """Goes on with a run that was stopped, or that shall be longer. Only its last frame is taken from the settings"""

    bl_idname = "charcloth.resume"
    bl_label = "Resume"
    resume = True

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There must be a run."""
        return super().poll(context) and can_resume(sheet_of(context))


class Cancel(_Sheet):
    """Stops after the frame in hand; Resume goes on with it"""

    bl_idname = "charcloth.cancel"
    bl_label = "Cancel"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Asks the program to end."""
        job = jobs.get(sheet_of(context).name)
        if job is not None:
            job.stop()
        return {"FINISHED"}


class Load(_Sheet):
    """Loads the frames exported last"""

    bl_idname = "charcloth.load"
    bl_label = "Load"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Loads."""
        sheet = sheet_of(context)
        try:
            loader.load(sheet, context.scene)
        except (ValueError, RuntimeError) as error:
            return self.fail(sheet, error)
        return {"FINISHED"}


class Unload(_Sheet):
    """Removes the burnt sheet from the scene and shows the original; files stay"""

    bl_idname = "charcloth.unload"
    bl_label = "Unload"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Removes."""
        loader.remove_burnt(sheet_of(context))
        return {"FINISHED"}


class AddSpark(_Sheet):
    """Adds an empty that lights the sheet where it touches it; move and scale it"""

    bl_idname = "charcloth.add_spark"
    bl_label = "Add Spark"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Puts a sphere at the 3D cursor."""
        settings = sheet_of(context).charcloth
        if settings.sparks is None:
            settings.sparks = bpy.data.collections.new(SPARKS)
            context.scene.collection.children.link(settings.sparks)
        spark = bpy.data.objects.new("Spark", None)
        spark.empty_display_type = "SPHERE"
        spark.empty_display_size = 0.012 / context.scene.unit_settings.scale_length
        spark.location = context.scene.cursor.location
        settings.sparks.objects.link(spark)
        return {"FINISHED"}


@persistent
def stop_all(*_: object) -> None:
    """Stops what runs: the file is closed, or Blender is."""
    for job in jobs.values():
        job.stop()
    jobs.clear()


CLASSES = (Burn, Resume, Cancel, Load, Unload, AddSpark)


def register() -> None:
    """Makes the buttons known."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.app.handlers.load_pre.append(stop_all)
    atexit.register(stop_all)


def unregister() -> None:
    """Stops what runs, and takes the buttons back."""
    stop_all()
    atexit.unregister(stop_all)
    bpy.app.handlers.load_pre.remove(stop_all)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
