"""``mocapdb fetch``: download the clips of a manifest."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mocapdb.cli._console import counted
from mocapdb.cli._options import json_option

if TYPE_CHECKING:
    from mocapdb.corpus.fetch import FetchPlan, FetchProgress, FetchReport

__all__ = ["fetch"]


@click.command()
@click.argument("names", nargs=-1, metavar="[CLIP|SUBJECT|CLASS]...")
@click.option("--all", "everything", is_flag=True, help="Every clip of the manifest.")
@click.option(
    "--out",
    "directory",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("cmu"),
    show_default=True,
    help="Folder that the files go to, one folder inside for each subject.",
)
@click.option(
    "--manifest",
    type=click.Path(dir_okay=False, path_type=Path),
    help="CSV file that says where the clips are; the CMU database by default.",
)
@click.option("--dry-run", is_flag=True, help="Say what would be downloaded, and stop.")
@click.option(
    "--rate",
    type=click.FloatRange(min=0, min_open=True, max=10),
    default=2.0,
    show_default=True,
    help="Requests a second, at most.",
)
@json_option
@click.pass_context
def fetch(
    ctx: click.Context,
    names: tuple[str, ...],
    everything: bool,
    directory: Path,
    manifest: Path | None,
    dry_run: bool,
    rate: float,
    as_json: bool,
) -> None:
    """Download clips and their skeletons.

    Name clips (02_01), subjects (02) or classes (walk), or say --all. Files that are there already
    are skipped, downloads that broke are resumed, and checksums are verified where they are known.
    The CMU database asks not to be crawled: fetch what you need.

    \b
    Example:
      mocapdb fetch 02_01 02_03 07_01 --out cmu
      mocapdb fetch salsa --dry-run
    """
    from mocapdb.corpus import fetch as fetching
    from mocapdb.corpus.manifest import read_manifest, select

    if bool(names) == everything:
        raise click.UsageError("Name clips, subjects or classes, or say --all for every clip.")
    entries = read_manifest(manifest)
    if not everything:
        entries = select(entries, names)
    if dry_run:
        plan = fetching.plan(entries, directory)
        click.echo(json.dumps(plan.to_dict()) if as_json else _describe_plan(plan))
        return
    policy = fetching.Policy(min_interval_s=1.0 / rate)
    with _progress_bar() as advance:
        report = fetching.fetch(entries, directory, policy=policy, progress=advance)
    for failure in report.failed:
        click.echo(failure.reason, err=True)
    click.echo(json.dumps(report.to_dict()) if as_json else _describe_report(report))
    unchecked = [each for each in fetching.plan(entries, directory).present if not each.sha256]
    if unchecked and not as_json:
        click.echo(
            f"{counted(len(unchecked), 'file')} could not be compared: the manifest has no "
            "checksum there",
            err=True,
        )
    if report.failed:
        ctx.exit(1)


def _describe_plan(plan: FetchPlan) -> str:
    lines = [
        f"{item.url} -> {item.path}" + ("" if item.sha256 else " (no checksum)")
        for item in plan.missing
    ]
    lines.append(f"{len(plan.missing)} files to download, {len(plan.present)} there already")
    return "\n".join(lines)


def _describe_report(report: FetchReport) -> str:
    return (
        f"{report.directory}: {len(report.done)} files downloaded "
        f"({report.bytes_received / 1e6:.1f} MB in {report.seconds:.0f} s), "
        f"{len(report.skipped)} there already, {len(report.failed)} failed"
    )


@contextmanager
def _progress_bar() -> Iterator[Callable[[FetchProgress], None]]:
    """Show a bar on stderr, or nothing where stderr is no terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    console = Console(stderr=True)
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[kilobytes]}"),
        console=console,
        disable=not console.is_terminal,
    ) as bar:
        task = bar.add_task("fetch", total=None, kilobytes="")

        def advance(state: FetchProgress) -> None:
            bar.update(
                task,
                description=state.download.path.name,
                completed=state.n_done,
                total=state.n_files,
                kilobytes=f"{state.bytes_done / 1e3:.0f} kB",
            )

        yield advance
        bar.update(task, completed=bar.tasks[task].total)
