"""The program at work beside Blender: commands one after the other, what they report, and how they are stopped."""

import json
import os
import queue
import signal
import subprocess
import threading
from dataclasses import dataclass, field
from typing import IO


@dataclass(frozen=True)
class Step:
    """One command, and what it does in a word."""

    label: str
    command: list[str]


@dataclass
class Job:
    """Commands that run one after the other. `poll` is called from time to time and never waits."""

    steps: list[Step]
    label: str = ""
    progress: float = 0.0
    left: float | None = None  # [s]
    frame: int | None = None
    warnings: list[str] = field(default_factory=list)
    error: str = ""
    stopped: bool = False
    done: bool = False

    def __post_init__(self) -> None:
        self._waiting = list(self.steps)
        self._process: subprocess.Popen[str] | None = None
        self._lines: queue.Queue[tuple[str, str]] = queue.Queue()
        self._threads: list[threading.Thread] = []
        self._said: list[str] = []
        self._start_next()

    def poll(self) -> bool:
        """Takes in what was reported; whether all is over."""
        if self.done or self._process is None:
            return True
        over = self._process.poll() is not None
        if over:
            for thread in self._threads:
                thread.join()
        while not self._lines.empty():
            self._take(*self._lines.get())
        if over:
            self._conclude(self._process.returncode)
        return self.done

    def wait(self) -> None:
        """Waits until all is over."""
        while not self.poll():
            if self._process is not None:
                try:
                    self._process.wait(timeout=0.1)
                except subprocess.TimeoutExpired:
                    continue

    def stop(self) -> None:
        """Asks the command to end well; it saves what it has."""
        self.stopped = True
        self._waiting.clear()
        if self._process is not None and self._process.poll() is None:
            self._process.send_signal(signal.CTRL_BREAK_EVENT if os.name == "nt" else signal.SIGINT)

    def _start_next(self) -> None:
        step = self._waiting.pop(0)
        self.label, self.progress, self.left = step.label, 0.0, None
        self._said.clear()
        own_group = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP} if os.name == "nt" else {}
        try:
            self._process = subprocess.Popen(
                step.command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                encoding="utf-8",
                errors="replace",
                **own_group,
            )
        except OSError as error:
            self.error, self.done = f"{step.command[0]}: {error.strerror}", True
            return
        streams = (("out", self._process.stdout), ("error", self._process.stderr))
        self._threads = [threading.Thread(target=self._listen, args=stream, daemon=True) for stream in streams]
        for thread in self._threads:
            thread.start()

    def _listen(self, name: str, stream: IO[str]) -> None:
        for line in stream:
            self._lines.put((name, line.rstrip("\n")))
        stream.close()

    def _take(self, stream: str, line: str) -> None:
        if stream == "error":
            self._said.append(line)
            return
        try:
            event = json.loads(line)
        except json.JSONDecodeError:
            return
        kind = event.get("event")
        if kind == "warning":
            self.warnings.append(event["text"])
        elif kind == "frame" and "frame" in event:
            self.frame, self.left = event["frame"], event["left_s"]
            self.progress = event["frame"] / max(event["last"], 1)
        elif kind == "frame":
            self.progress = event["done"] / max(event["total"], 1)

    def _conclude(self, code: int) -> None:
        if code != 0 and not self.stopped:
            words = "\n".join(line for line in self._said if line.strip())
            self.error = words or f"the program ended with {code}"
        if self.error or self.stopped or not self._waiting:
            self.done = True
        else:
            self._start_next()
