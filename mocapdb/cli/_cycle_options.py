"""The options of ``mocapdb cycle`` that say how a cycle is searched: none needs to be given."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from mocapdb.cycles.tuning import EMBEDDING_AXES, N_HARMONICS, PRIME

if TYPE_CHECKING:
    from mocapdb.cycles import Settings

__all__ = ["cycle_settings", "search_options"]

OPTIONS = (
    click.option(
        "--model", type=click.Choice(["harmonic", "typical", "m1", "m2", "m3"]), default="harmonic",
        show_default=True,
        help="Harmonic regression of poses, smoothed as much as laps differ; typical trajectory, "
        "centroids of poses of like phase; or Raunio's regressions: weighted with velocities, of "
        "poses alone, unweighted.",
    ),
    click.option(
        "--harmonics", type=click.IntRange(1), default=N_HARMONICS, show_default=True,
        help="Most harmonics of the curve.",
    ),
    click.option("--ridge", type=float, default=0.0, help="Penalty on the harmonics."),
    click.option("--no-velocities", is_flag=True, help="m1 and m3 do without velocities."),
    click.option("--no-accelerations", is_flag=True, help="m1 and m3 do without accelerations."),
    click.option(
        "--root-harmonics", type=click.IntRange(1),
        help="Most harmonics of the root's translation; those of the curve by default.",
    ),
    click.option(
        "--root-axes", default="xyz", show_default=True,
        help="Axes of the file along which the root moves, seen from its heading; along the others "
        "it stays.",
    ),
    click.option(
        "--root-linear", default="xyz", show_default=True,
        help="Those along which it may advance, not only sway.",
    ),
    click.option(
        "--timing", type=click.Choice(["linear", "drift", "whole-laps", "uniform", "mixture"]),
        help="How phase becomes time; chosen from the clip by default.",
    ),
    click.option(
        "--features", type=click.Choice(["positions", "angles", "rotations"]), default="positions",
        show_default=True, help="What of the pose is looked at for the period.",
    ),
    click.option(
        "--root", "root_part", type=click.Choice(["drop", "orientation", "differences"]),
        default="drop", show_default=True, help="What of the root is looked at.",
    ),
    click.option("--joints", help="Only these joints are looked at: names with commas between."),
    click.option("--no-bone-length", is_flag=True, help="Count every joint alike."),
    click.option("--normalise", is_flag=True, help="Count every dimension by its own spread."),
    click.option(
        "--components", type=click.IntRange(1), default=EMBEDDING_AXES, show_default=True,
        help="Principal axes that are kept.",
    ),
    click.option("--delays", type=click.IntRange(0), help="Later poses added to each."),
    click.option("--lag", type=click.IntRange(1), help="Frames between them."),
    click.option("--join-neighbours", is_flag=True, help="Poses next in time are at distance 0."),
    click.option("--epsilon", type=float, help="Largest distance at which poses are joined."),
    click.option(
        "--rank", type=click.IntRange(0), default=0, show_default=True,
        help="Which loop: 0 is the most persistent, see the report's diagram.",
    ),
    click.option("--prime", type=int, default=PRIME, show_default=True,
                 help="Cohomology is computed modulo this prime."),
)  # fmt: skip


def search_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options to a command."""
    for option in reversed(OPTIONS):
        command = option(command)
    return command


def cycle_settings(
    *,
    model: str,
    harmonics: int,
    ridge: float,
    no_velocities: bool,
    no_accelerations: bool,
    root_harmonics: int | None,
    root_axes: str,
    root_linear: str,
    timing: str | None,
    features: str,
    root_part: str,
    joints: str | None,
    no_bone_length: bool,
    normalise: bool,
    components: int,
    delays: int | None,
    lag: int | None,
    join_neighbours: bool,
    epsilon: float | None,
    rank: int,
    prime: int,
) -> Settings:
    """Return what the options say.

    Raises
    ------
    CycleError
        If one is out of range.
    """
    from mocapdb.cycles import Settings
    from mocapdb.cycles.closing import RootFit
    from mocapdb.cycles.phase.pose_cloud import Embedding

    if model not in ("m1", "m3") and (no_velocities or no_accelerations):
        raise click.UsageError(
            "Expected --no-velocities and --no-accelerations with --model m1 or m3: the "
            "others have neither."
        )
    names = None if joints is None else tuple(name.strip() for name in joints.split(","))
    if names is not None and "" in names:
        raise click.UsageError(
            f"Expected names of joints with single commas between, but got {joints!r}."
        )
    if epsilon is not None and not (math.isfinite(epsilon) and epsilon > 0):
        raise click.UsageError(f"Expected a positive distance with --epsilon, but got {epsilon}.")
    if not (math.isfinite(ridge) and ridge >= 0):
        raise click.UsageError(f"Expected a penalty of 0 or more with --ridge, but got {ridge}.")
    embedding = Embedding(
        features=features,  # type: ignore[arg-type] # click has checked these
        root=root_part,  # type: ignore[arg-type]
        joints=names,
        by_bone_length=not no_bone_length,
        normalise=normalise,
        n_components=components,
        delays=delays,
        lag=lag,
        join_neighbours=join_neighbours,
    )
    return Settings(
        model=model,  # type: ignore[arg-type]
        n_harmonics=harmonics,
        ridge=ridge,
        timing=timing,  # type: ignore[arg-type]
        embedding=embedding,
        prime=prime,
        rank=rank,
        max_epsilon=epsilon,
        use_velocities=not no_velocities,
        use_accelerations=not no_accelerations,
        root=RootFit(root_harmonics, root_axes.lower(), root_linear.lower()),
    )
