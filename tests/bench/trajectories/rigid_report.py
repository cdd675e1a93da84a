"""Measures the recordings of rigid bodies, and writes their part of RESULTS.md. Python alone."""

import csv
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
# for every recording. They were set for FIRST_WORLDS; the other worlds were added because they differ in kind.
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


def recordings(measured):
    """Return the name, rate, error in percent and in metres, and rows of each measurement."""
    return [(f"{name}-{hz}", hz, percent, error, own)
            for name, own in measured.items() for hz in RATES for percent, error in rigid.ERRORS.items()]  # fmt: skip


def gain_table(measured):
    """How many times the bytes of `tracker` those of `entropy` are at 5 percent, at both rates."""
    found = {predictor: gains(measured, 5, predictor) for predictor in PREDICTORS}
    lines = [[f"`{name}`", *("; ".join(f"{found[predictor][f'{name}-{hz}']:.2f}" for hz in RATES) for predictor in PREDICTORS)]
             for name in measured]  # fmt: skip
    return table(["recording", *PREDICTORS], lines)


def largest_text(measured):
    """Say where the surface was further off than the threshold."""
    rows = {what: {(name, percent): surface(own[hz, percent, what], "max") for name, hz, percent, _, own in recordings(measured)}
            for what in ("entropy", *PREDICTORS)}  # fmt: skip
    most = max(max(rows[predictor].values()) for predictor in PREDICTORS)
    beyond = {at: value for at, value in rows["entropy"].items() if value >= 1.005}
    text = f"The largest error of `tracker` is {most:.2f} of the threshold"
    if not beyond:
        return f"{text}, and so is that of `entropy`."
    (name, percent), worst = max(beyond.items(), key=lambda item: item[1])
    return f"{text}; that of `entropy` is above it in {len(beyond)} of {len(rows['entropy'])} rows, at most {worst:.2f} (`{name}`, {percent} %)."


def turning_rows(measured):
    """The header and rows of turning.csv: bytes a frame, RMS and largest error of the surface in thresholds."""
    whats = ("entropy", *PREDICTORS)
    lines = [["recording", "mm", *(f"{what} {column}" for what in whats for column in ("bytes", "rms", "max")), "at rest", "auto"]]
    for name, hz, percent, error, own in recordings(measured):
        cells = [f"{value:.2f}" for row in (own[hz, percent, what] for what in whats)
                 for value in (row["bytes"], surface(row, "rms"), surface(row, "max"))]  # fmt: skip
        lines.append([name, f"{1000 * error:g}", *cells, f"{own[hz, percent, 'ballistic']['at_rest_per_frame']:.0f}", own[hz, "auto"]])
    return lines


def positions_rows(measured):
    """The header and rows of positions.csv: bytes a frame of the bodies' centres alone; the peers at 5 percent."""
    lines, peers = [], []
    for name, hz, percent, error, own in recordings(measured):
        entropy, tracker = (own[hz, percent, FLAT][codec] for codec in ("entropy", "tracker"))
        line = [name, f"{1000 * error:g}", f"{entropy['bytes']:.0f}", f"{tracker['bytes']:.1f}",
                f"{tracker['rms_error'] / tracker['threshold']:.2f}", f"{tracker['at_rest_per_frame']:.0f}"]  # fmt: skip
        if percent == 5:
            peers, cells = peer_cells(own[hz, percent, FLAT], tracker["bytes"])
            line += cells
        lines.append(line)
    header = ["recording", "mm", "entropy", "ballistic", "rms", "at rest", *peers, "best of them, times tracker's"]
    return [header, *(line + [""] * (len(header) - len(line)) for line in lines)]


def positions_text(measured):
    means = []
    for percent in rigid.ERRORS:
        pairs = [own[hz, percent, FLAT] for own in measured.values() for hz in RATES]
        means.append(f"{statistics.geometric_mean(rows['entropy']['bytes'] / rows['tracker']['bytes'] for rows in pairs):.2f}")
    return f"Of positions alone `entropy` needs {', '.join(means)} times the bytes of `tracker` with `ballistic`, in the geometric mean."


def write_rows(measured, folder):
    """Write turning.csv and positions.csv."""
    for name, rows in (("turning", turning_rows(measured)), ("positions", positions_rows(measured))):
        with open(folder / f"{name}.csv", "w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)


def document(measured):
    errors = ", ".join(f"{1000 * error:g}" for error in rigid.ERRORS.values())
    return f"""## Rigid bodies with orientation

{ENGINES["bullet"][0]} bodies ({ENGINES["mujoco"][0]} of MuJoCo) of about {rigid.EDGE} m for {FRAMES * rigid.DT_S:g} s. The largest error of any point of a surface is 1, 5 and 10 %
of that: {errors} mm. Gain: bytes of `entropy` over those of `tracker`; bold where it is below its floor. Largest RMS: of the
surface error over the threshold; at most {MOST_RMS} is asked. Nothing was tuned on this seed. The floors were set for the first
worlds, {", ".join(f"`{world}`" for world in FIRST_WORLDS)}; the others were added because they differ in kind.

{summary_table(measured)}
The same at 5 %, at 60; 30 Hz:

{gain_table(measured)}
{largest_text(measured)} Why, says [README.md](README.md). {positions_text(measured)}

All rows: [turning.csv](turning.csv) (bytes a frame; RMS and largest error of the surface over the threshold; bodies at rest with `ballistic`; `auto`: what
`--predictor auto` takes before a server has measured) and [positions.csv](positions.csv) (the same bodies' centres, also by peers, which code positions only).
"""
