"""Verbs about recorded runs."""

import threading
from pathlib import Path
from typing import Annotated, Literal

import tyro

from schemas.errors import UserError
from services.commands.output import print_json, print_table, say


def record(out: Path | None = None, realm: str = "default") -> int:
    """Record a running system until Ctrl-C.

    Args:
        out: file to write; without it a new one in runs/.
        realm: of the running system.
    """
    import msgspec

    from services.process_table import process_named
    from services.runtime.link import Link
    from services.runtime.process import run_process
    from services.runtime.run_directory import RunDirectory
    from services.runtime.system import log_path

    info = RunDirectory.of(realm).info()
    target = out or log_path(info.run, Path("runs"))
    run = msgspec.structs.replace(info.run, log=str(target.resolve()))
    say(f"recording to {target}; end with Ctrl-C")
    link = Link.to(info.endpoint, Path(info.tls) if info.tls else None)
    run_process(process_named("recorder"), run, link)
    return 0


def replay(
    file: Annotated[Path, tyro.conf.Positional],
    rate: float = 1.0,
    to: Literal["web"] | None = None,
    port: int = 8080,
    json: bool = False,
) -> int:
    """Play a log back.

    Args:
        file: an MCAP file of 'incognita record' or of a run.
        rate: 2 is twice as fast, 0 is without waiting.
        to: "web" shows it on a page; without it the messages are listed.
        port: of the page.
        json: one JSON document a message on stdout.
    """
    from services.runtime.log_file import read_log
    from services.runtime.replay import paced

    if to == "web":
        return _replay_on_page(file, rate, port)
    for entry in paced(read_log(file), rate, threading.Event()):
        if json:
            print_json({"topic": entry.topic, "log_ns": entry.log_ns, "sequence": entry.sequence})
        else:
            print(f"{entry.log_ns / 1e9:.3f} {entry.topic} #{entry.sequence} {len(entry.data)} B")
    return 0


def log(
    action: Annotated[Literal["info", "check", "recover", "export"], tyro.conf.Positional],
    file: Annotated[Path, tyro.conf.Positional],
    what: Literal["messages", "decisions", "camera", "map"] = "messages",
    out: Path | None = None,
    json: bool = False,
) -> int:
    """Inspect, check, mend or export a log.

    Args:
        action: info: what is in it; check: what is missing; recover: mend a file whose writer was
            killed; export: take something out of it.
        file: an MCAP file.
        what: of an export: messages as JSON lines, decisions as CSV, camera as a video (WebM) with
            boxes around what was found, map as an animated GIF.
        out: file to write (recover, export).
        json: one JSON document on stdout.
    """
    if action == "export":
        return _export(file, what, out, json)
    actions = {"info": _info, "check": _check, "recover": _recover}
    return actions[action](file, out, json)


def _info(file: Path, out: Path | None, as_json: bool) -> int:
    from services.runtime.log_file import log_summary

    del out
    summary = log_summary(file)
    if as_json:
        print_json(summary)
        return 0
    seconds = (summary["end_ns"] - summary["start_ns"]) / 1e9
    per_minute = summary["bytes_per_minute"]
    print(
        f"{file}: {summary['messages']} messages, {seconds:.1f} s, {summary['bytes'] / 1e6:.1f} MB"
        + (f", {per_minute / 1e6:.1f} MB a minute" if per_minute else "")
    )
    print_table(("topic", "messages", "Hz"), _rates(summary["topics"], seconds))
    print_table(("for viewers", "messages", "Hz"), _rates(summary["shown"], seconds))
    for name, fields in summary["metadata"].items():
        print(f"{name}: " + ", ".join(f"{key}={value}" for key, value in fields.items()))
    return 0


def _rates(counts: dict[str, int], seconds: float) -> list[tuple[str, int, str]]:
    return [(t, n, f"{n / seconds:.1f}" if seconds > 0 else "-") for t, n in counts.items()]


def _check(file: Path, out: Path | None, as_json: bool) -> int:
    from services.runtime.repair import check_log

    del out
    problems = check_log(file)
    if as_json:
        print_json({"file": str(file), "ok": not problems, "problems": problems})
    else:
        print("\n".join(problems) if problems else f"{file}: complete")
    return 0 if not problems else 2


def _recover(file: Path, out: Path | None, as_json: bool) -> int:
    from services.runtime.repair import recover

    target = out or file.with_stem(f"{file.stem}-recovered")
    if target.exists():
        raise UserError(f"{target} exists; choose another file with --out")
    count = recover(file, target)
    if as_json:
        print_json({"file": str(target), "messages": count})
    else:
        print(f"{target}: {count} messages recovered")
    return 0


def _export(file: Path, what: str, out: Path | None, as_json: bool) -> int:
    suffixes = {"messages": ".jsonl", "decisions": ".csv", "camera": ".webm", "map": ".gif"}
    writers = {
        "messages": _write_messages,
        "decisions": _write_decisions,
        "camera": _write_camera,
        "map": _write_map,
    }
    target = out or file.with_suffix(suffixes[what])
    count = writers[what](file, target)
    if not count:
        target.unlink(missing_ok=True)
        raise UserError(f"{file}: nothing of the {what} is recorded in it")
    if as_json:
        print_json({"file": str(target), "what": what, "count": count})
    else:
        say(f"{target}: {count} {_counted[what]} written")
    return 0


_counted = {
    "messages": "messages",
    "decisions": "decisions",
    "camera": "pictures",
    "map": "pictures",
}


def _write_messages(file: Path, target: Path) -> int:
    import json as json_module

    from schemas.codec import as_builtins
    from schemas.topics import ALL_TOPICS
    from services.runtime.log_file import read_messages

    count = 0
    with target.open("w") as stream:
        for log_ns, topic, message in read_messages(file, ALL_TOPICS):
            count += 1
            row = {"topic": topic.key, "log_ns": log_ns, "message": as_builtins(message)}
            stream.write(json_module.dumps(row) + "\n")
    return count


def _write_decisions(file: Path, target: Path) -> int:
    from services.recorder.export.decisions import write_decisions

    with target.open("w", newline="") as stream:
        return write_decisions(file, stream)


def _write_camera(file: Path, target: Path) -> int:
    from services.perception.camera.video_file import write_video
    from services.recorder.export.camera import FPS, film

    return write_video(film(file), target, FPS)


def _write_map(file: Path, target: Path) -> int:
    from services.recorder.export.map_film import write_gif

    return write_gif(file, target)


def _replay_on_page(file: Path, rate: float, port: int) -> int:
    from services.runtime.replay_system import replay_on_page
    from services.runtime.system import stop_on_signals

    stop = threading.Event()
    stop_on_signals(stop)
    replay_on_page(file, rate, port, stop, say)
    return 0
