"""Measures the recordings of rigid bodies, and writes their part of RESULTS.md. Python alone."""

import statistics

import rigid
from measuring import measure, peer_cells, table

FRAMES = 1200  # 20 s at 60 Hz
# The bodies of an engine, and its worlds. MuJoCo keeps a dense matrix of all contacts.
ENGINES = {"bullet": (1000, rigid.WORLDS), "ode": (1000, rigid.WORLDS), "mujoco": (300, ("drum", "wall"))}
RATES = (60, 30)
RECORDINGS = {f"{engine}-{world}": (engine, world) for engine, (_, worlds) in ENGINES.items() for world in worlds}
PREDICTORS = ("ballistic", "field", "rigid")
# How many times the bytes of `tracker` those of `entropy` must be at least, by error in percent of a body: in the geometric mean, and
# for every recording. They were set when these were the worlds; the others were added because they differ in kind.
FLOORS = {1: (7, 4.5), 5: (11, 7), 10: (13, 8.5)}
FIRST_WORLDS = ("pile", "mixed", "towers", "rest")
MOST_RMS = 0.75  # of the threshold
FLAT = "positions"


def measure_all(tool, folder, name):
    """Return rows by (Hz, percent, what). `what` is `entropy`, a predictor of `tracker`, or FLAT for positions alone. The peers
    are in the rows at 5 percent; [Hz, "auto"] is the predictor that `auto` takes."""
    found = {}
    for hz in RATES:
        npy, flat = folder / f"{name}-{hz}.npy", folder / f"{name}-{hz}-{FLAT}.npy"
        found[hz, "auto"] = measure(tool, npy, "tracker", "auto", "--frames", "1")["tracker"]["predictor"]
        for percent, error in rigid.ERRORS.items():
            at = ["--threshold", repr(error)]
            both = measure(tool, npy, "entropy,tracker", "ballistic", *at)
            found[hz, percent, "entropy"], found[hz, percent, "ballistic"] = both["entropy"], both["tracker"]
            for predictor in PREDICTORS[1:]:
                found[hz, percent, predictor] = measure(tool, npy, "tracker", predictor, *at)["tracker"]
            both = measure(tool, flat, "entropy,tracker", "ballistic", *at, *(["--peers"] if percent == 5 else []))
            found[hz, percent, FLAT] = both
    return found


def surface(row, which):
    """Return the maximum or RMS error of the surface as a share of the threshold."""
    return row[f"{which}_surface_error"] / row["threshold"]


def largest(row):
    """Format the maximum surface error, bold if it is above the threshold."""
    most = surface(row, "max")
    return f"{most:.2f}" if most < 1.005 else f"**{most:.2f}**"


def gains(measured, percent, predictor):
    """Return how many times the bytes of `tracker` those of `entropy` are, by recording."""
    return {f"{name}-{hz}": own[hz, percent, "entropy"]["bytes"] / own[hz, percent, predictor]["bytes"]
            for name, own in measured.items() for hz in RATES}  # fmt: skip


def without_dominoes(found):
    """Return the values without those of dominoes; if there are no others, all."""
    return {name: value for name, value in found.items() if "dominoes" not in name} or found


def of_first_worlds(found):
    """Return the values of FIRST_WORLDS; if there are none, all."""
    return {name: value for name, value in found.items() if name.split("-")[1] in FIRST_WORLDS} or found


def at_least(value, floor):
    """Format a value, bold if it is below the floor."""
    return f"{value:.2f}" if value >= floor else f"**{value:.2f}**"


def summary_table(measured):
    lines = []
    for percent, (mean, each) in FLOORS.items():
        for predictor in PREDICTORS:
            found = gains(measured, percent, predictor)
            first = of_first_worlds(found)
            means = [statistics.geometric_mean(some.values()) for some in (found, without_dominoes(found), first)]
            least, least_first = (min(some, key=some.get) for some in (found, first))
            rms = {f"{name}-{hz}": surface(own[hz, percent, predictor], "rms") for name, own in measured.items() for hz in RATES}
            worst = max(rms, key=rms.get)
            lines.append([f"{percent} %", predictor, *(at_least(value, mean) for value in means), f"{mean}",
                          *(f"{at_least(found[one], each)} `{one}`" for one in (least, least_first)), f"{each}",
                          f"{rms[worst]:.2f} `{worst}`"])  # fmt: skip
    return table(["error", "predictor", "geometric mean", "without dominoes", "of the first worlds", "floor", "least",
                  "of the first worlds", "floor", "largest RMS"], lines)  # fmt: skip


def gain_table(measured):
    lines = []
    for name, own in measured.items():
        for hz in RATES:
            for percent, error in rigid.ERRORS.items():
                entropy, *rows = (own[hz, percent, what] for what in ("entropy", *PREDICTORS))
                line = [f"`{name}-{hz}`", f"{1000 * error:g}", f"{entropy['bytes']:.0f}", f"{surface(entropy, 'rms'):.2f}",
                        largest(entropy)]  # fmt: skip
                for row in rows:
                    line += [f"{row['bytes']:.1f}", at_least(entropy["bytes"] / row["bytes"], FLOORS[percent][1]),
                             f"{surface(row, 'rms'):.2f}", largest(row)]  # fmt: skip
                lines.append([*line, f"{rows[0]['at_rest_per_frame']:.0f}", own[hz, "auto"]])
    columns = [f"{predictor}{what}" for predictor in PREDICTORS for what in ("", ": gain", ": RMS", ": max")]
    return table(["recording", "mm", "entropy", "RMS", "max", *columns, "at rest", "auto"], lines)


def flat_table(measured):
    lines, peers = [], []
    for name, own in measured.items():
        for hz in RATES:
            for percent, error in rigid.ERRORS.items():
                entropy, tracker = (own[hz, percent, FLAT][codec] for codec in ("entropy", "tracker"))
                line = [f"`{name}-{hz}`", f"{1000 * error:g}", f"{entropy['bytes']:.0f}", f"{tracker['bytes']:.1f}",
                        f"{entropy['bytes'] / tracker['bytes']:.2f}", f"{tracker['rms_error'] / tracker['threshold']:.2f}",
                        f"{tracker['at_rest_per_frame']:.0f}"]  # fmt: skip
                if percent == 5:
                    peers, cells = peer_cells(own[hz, percent, FLAT], tracker["bytes"])
                    line += cells
                lines.append(line)
    for percent, error in rigid.ERRORS.items():
        pairs = [own[hz, percent, FLAT] for own in measured.values() for hz in RATES]
        gain = statistics.geometric_mean(rows["entropy"]["bytes"] / rows["tracker"]["bytes"] for rows in pairs)
        lines.append(["geometric mean", f"{1000 * error:g}", "", "", f"**{gain:.2f}**"])
    width = 7 + len(peers) + 1
    return table(["recording", "mm", "entropy", "ballistic", "gain", "RMS", "at rest", *peers, "best of them, times tracker's"],
                 [line + [""] * (width - len(line)) for line in lines])  # fmt: skip


def document(measured):
    errors = ", ".join(f"{1000 * error:g}" for error in rigid.ERRORS.values())
    return f"""## Rigid bodies with orientation

{ENGINES["bullet"][0]} bodies ({ENGINES["mujoco"][0]} of MuJoCo) of about {rigid.EDGE} m for {FRAMES * rigid.DT_S:g} s. The largest error of any point of a surface is 1, 5 and 10 %
of that: {errors} mm. Gain: bytes of `entropy` over those of `tracker`; bold where it is below its floor. Largest RMS: of the
surface error over the threshold; at most {MOST_RMS} is asked. Nothing was tuned on this seed. The floors were set for the first
worlds, {", ".join(f"`{world}`" for world in FIRST_WORLDS)}; the others were added because they differ in kind.

{summary_table(measured)}
Bytes a frame. RMS and max: of the surface error over the threshold. At rest: bodies with `ballistic`, in the mean. A max
in bold is beyond the threshold; why, says [README.md](README.md). Auto: what `--predictor auto` takes
before a server has measured (it then offers `rigid` where that pays).

{gain_table(measured)}
### Positions alone

The same bodies without their orientations, as centres: `entropy` and `tracker` at the same errors, peers, which code positions
only, at 5 %.

{flat_table(measured)}"""
