"""How a diagnosis is graded against its answer key, and how many grades become one table.

Definitions. L of an effect: the detection limit that the diagnosis itself states for its first number in
its excitation table. Strata of single effects: weak below 3 L, strong from 3 L on; below L, or where
the run does not excite the effect at all, silence is the right answer. A name is right when effect
and place are; a declared number found out of tolerance is right when it belongs to the effect. An attribution
is an effect that the report names, minor or not, of the machine or of the measurement but not of the set-up. A pair
or triple is strong when each of its effects is, and strong beside the others when each is by the limit that is
stated beside what else was found, too. A number whose true value is nought (no time constant) has no
relative error.
"""

import math
import re
import statistics

SILENT = ("NO DEVIATION", "NOT IDENTIFIABLE")
OPEN = ("UNEXPLAINED", "PARTLY")

# The same motion under two names, which no record can tell apart.
ALIASES = {"bus_latency": "command_delay"}

TRAVEL_PER_TURN = {"X": 12.0, "Y": 12.0, "Z": 12.0, "A": 360.0, "C": 360.0}  # mm, deg


def waves_per_turn(name, place, numbers):
    """Of a wave of the motor's force; None: of no such effect."""
    for key, value in numbers.items():
        if name == "torque_ripple" and key.endswith("order"):
            return value
        if name == "cogging" and "pole_pitch_" in key:
            return TRAVEL_PER_TURN[place] / value
    return None


def same_wave(effect, found):
    """Cogging with a whole number of waves per turn of the motor and a torque ripple of that order are one motion."""
    if {effect["name"], found["name"]} != {"cogging", "torque_ripple"} or effect["place"] != found["axis"]:
        return False
    true = waves_per_turn(effect["name"], effect["place"], effect["parameters"])
    told = waves_per_turn(found["name"], found["axis"], {n["key"]: n["value"] for n in found.get("parameters", [])})
    return true is not None and told is not None and abs(told - true) < 0.02 * true


# Where the force, displacement or reading of an effect may show up as a law.
HOOKS = {
    "reception": ("command", "command_time"), "setpoint": ("command", "command_time"),
    "servo": ("command", "command_time", "motor_force", "table_force"),
    "encoder": ("command", "displacement", "motor_force", "table_force"),
    "motor force": ("motor_force", "table_force"), "transmission": ("displacement", "table_force", "motor_force"),
    "load force": ("table_force", "motor_force"), "friction": ("table_force", "motor_force"),
    "displacement": ("displacement", "reading"), "pose": ("displacement", "reading"),
    "touch": ("reading", "displacement"), "deflection": ("reading", "displacement"),
    "analogue": ("reading", "displacement"), "reading": ("reading", "displacement"),
}


def same(effect, found):
    """Whether a found effect is the true one."""
    name, place = effect["name"], effect["place"]
    if found["name"] in (name, ALIASES.get(name)):
        return found["axis"] == place
    if same_wave(effect, found):
        return True
    if found["name"] == "deviation":
        key = found["axis"]
        if name == "load_mass":
            return key.startswith(f"axes.{place}.load_")
        return key.startswith(f"effects.{place}.{name}.")
    return False


def suspect(effect):
    """How `vcnc diagnose --suspect` calls an effect."""
    if effect["name"] == "load_mass":
        return f"axes.{effect['place']}.load_{'kgm2' if effect['place'] in 'AC' else 'kg'}"
    return f"{effect['place']}.{ALIASES.get(effect['name'], effect['name'])}"


def left_of(report):
    """Of held-out laps: RMS of every signal that has noise, and chi-square with what noise leaves of it."""
    return {"rms": {f["signal"]: f["rms_after"] for f in report.get("figures", [])
                    if f.get("rms_floor") and "held" in f["run"]}, **report["chi2_held_out"]}


def label(e):
    return f"{e['name']} {e.get('axis', e.get('place'))}"


def claims(report):
    """Where the piece was clamped is no claim about the machine."""
    return [e for e in report.get("effects", []) if e.get("axis") != "setup"]


def in_class(effect, found):
    return any(text in (f"{effect['place']}.{effect['name']}", f"{effect['name']} {effect['place']}",
                        f"effects.{effect['place']}.{effect['name']}") or
               text.startswith(f"effects.{effect['place']}.{effect['name']}.") for text in found.get("class", []))


def limit_of(report, name, beside=False):
    """Detection limit in the unit of the first number, `beside` what else was found where something was; None: the report
    says nothing of it."""
    place, _, effect = name.partition(".")
    names = {name, f"{name}.deviation", f"{place}.{ALIASES.get(effect, effect)}"}
    for row in report.get("excitation", []):
        if row["name"] in names:
            value = row.get("detection_limit")
            if beside:
                value = row.get("detection_limit_beside_found", value)
            return math.inf if value is None else float(value)
    return None


def strength(effect, size, limit):
    """Of its detection limit. A range is shown by any limit below the largest that is seen."""
    if limit is None:
        return math.nan
    if effect["name"] == "range_clip":
        return math.inf if 0 < size <= limit < math.inf else 0.0
    return size / limit if limit else math.inf


def weakest(effects, sizes, limits):
    strengths = [strength(e, size, l) for e, (_, size), l in zip(effects, sizes, limits)]
    return math.nan if any(map(math.isnan, strengths)) else min(strengths)


def first_number(effect):
    for key, value in effect["parameters"].items():
        if isinstance(value, list):
            return abs(value[0])
        return abs(value)
    return 0.0


def stem(key):
    """The key without the component of a vector."""
    return re.sub(r"\.[xyz]$", "", key)


def within(true, low, high):
    """None: without a limit."""
    return bool((low is None or low <= true) and (high is None or true <= high))


def numbers_of(found):
    return {n["key"]: n for n in found.get("parameters", [])}


def half_a_turn_on(values, numbers):
    """Whether the wave that was told is the true one half a turn on, with the other sign."""
    for key, number in numbers.items():
        if "phase_deg" in key and key in values:
            return math.cos(math.radians(number["value"] - values[key])) < 0
    return False


def grade(answer, report, seconds):
    """One row."""
    told = claims(report)
    row = {"kind": answer["kind"], "truth": [label(e) for e in answer["effects"]] or [answer.get("unknown", "")],
           "told": [label(e) for e in told], "verdict": report["verdict"], "seconds": seconds,
           "law": " and like ".join(law["behaves_like"] for law in report["laws"]), "number": answer.get("number"),
           "claims": len(told)}
    effects = answer["effects"]
    if answer.get("without"):
        row["kind"] = "without"
    if effects:
        row["right"] = [any(same(e, f) for f in told) for e in effects]
        row["top"] = bool(told) and any(same(e, told[0]) for e in effects)
        row["class"] = max((1 / (1 + len(told[0].get("class", []))) for e in effects
                            if same(e, told[0]) or in_class(e, told[0])), default=0.0) if told else 0.0
        row["exact"] = all(row["right"]) and len(told) == len(effects)
        sizes = answer.get("sizes") or [(f"{e['place']}.{e['name']}", first_number(e)) for e in effects]
        limits = [limit_of(report, name) for name, _ in sizes]
        row["strength"] = weakest(effects, sizes, limits)
        # What is told beside something false is measured by its limit alone: falsehoods excuse nothing.
        false = any(not any(same(e, f) for e in effects) for f in told)
        row["strength_beside"] = row["strength"] if false else weakest(
            effects, sizes, [limit_of(report, name, beside=True) for name, _ in sizes])
        row["silent"] = not told and report["verdict"].startswith(SILENT)
        row["errors"], row["covered"] = [], []
        for e in effects:
            for f in told:
                if not same(e, f):
                    continue
                for key, number in numbers_of(f).items():
                    true = answer.get("values", {}).get(key)
                    if true is None or re.search(r"phase|angle_deg", key):
                        continue
                    # A wave half a turn on is the same wave.
                    if "amplitude" in key and key[-2:] not in (".x", ".y", ".z") and any("phase" in k for k in numbers_of(f)):
                        true = math.copysign(true, number["value"])
                    if "weight_imbalance.torque" in key:  # so is a weight on the other side that pulls the other way
                        true = math.copysign(true, number["value"])
                    if "_wave_" in key and half_a_turn_on(answer["values"], numbers_of(f)):
                        true = -true
                    # A component that is nearly nothing is held against the largest of its vector.
                    scale = max(abs(v) for k, v in answer["values"].items() if stem(k) == stem(key))
                    if scale > 0:
                        row["errors"].append(abs(number["value"] - true) / scale)
                    row["covered"].append(within(true, number["low"], number["high"]))
    if row["kind"] in ("unknown", "without"):
        law = report["laws"][0] if report["laws"] else {}
        row["rejected"] = report["verdict"].startswith(OPEN)
        row["law_right"] = bool(law) and law.get("axis") in answer["law_axes"] and law.get("point") in answer["law_points"]
    ratios = []
    for f in report.get("figures", []):
        if f.get("rms_floor") and "held" in f["run"]:
            ratios.append(f["rms_after"] / f["rms_floor"])
    row["after_over_floor"] = max(ratios) if ratios else None
    row["left"] = left_of(report)
    return row


def share(flags):
    flags = list(flags)
    return f"{sum(flags)}/{len(flags)} ({100 * sum(flags) / len(flags):.1f} %)" if flags else "none drawn"


def percentile(values, p):
    values = sorted(values)
    return values[min(len(values) - 1, int(p / 100 * len(values)))] if values else math.nan


def summary(rows):
    """Metric -> text, of the rows of one part."""
    out = {}
    clean = [r for r in rows if r["kind"] == "clean"]
    single = [r for r in rows if r["kind"] == "single"]
    strong = [r for r in single if r["strength"] >= 3]
    weak = [r for r in single if 1 <= r["strength"] < 3]
    blind = [r for r in single if r["strength"] < 1]
    untold = [r for r in single if math.isnan(r["strength"])]
    out["clean machines accused"] = share(r["claims"] > 0 for r in clean)
    out["single: top-1 name and place, all"] = share(r["top"] for r in single)
    out["single: top-1, strong (from 3 L)"] = share(r["top"] for r in strong)
    out["single: top-1, weak (1 to 3 L)"] = share(r["top"] for r in weak)
    out["single: below L, silent"] = share(r["silent"] for r in blind)
    if untold:
        out["single: no limit stated, top-1"] = share(r["top"] for r in untold)
    out["single: exactly the truth and nothing else"] = share(r["exact"] for r in single)
    out["single: mean class score"] = f"{statistics.mean(r['class'] for r in single):.3f}" if single else "none drawn"
    for kind in ("pair", "triple"):
        some = [r for r in rows if r["kind"] == kind]
        out[f"{kind}: exact set"] = share(r["exact"] for r in some)
        out[f"{kind}: exact set, each effect strong"] = share(r["exact"] for r in some if r["strength"] >= 3)
        out[f"{kind}: exact set, each effect strong beside the others"] = share(
            r["exact"] for r in some if min(r["strength"], r["strength_beside"]) >= 3)
        out[f"{kind}: effects found"] = share(flag for r in some for flag in r["right"])
        out[f"{kind}: claims that are true"] = share(
            [True] * sum(sum(r["right"]) for r in some) + [False] * sum(max(0, r["claims"] - sum(r["right"])) for r in some))
    for kind, text in (("unknown", "outside the library"), ("without", "left out of the library")):
        some = [r for r in rows if r["kind"] == kind]
        out[f"{text}: not explained away"] = share(r["rejected"] for r in some)
        out[f"{text}: law named, of those"] = share(r["law_right"] for r in some if r["rejected"])
    errors = [e for r in rows for e in r.get("errors", [])]
    covered = [c for r in rows for c in r.get("covered", [])]
    out["parameter error, median / p95"] = (
        f"{100 * statistics.median(errors):.1f} % / {100 * percentile(errors, 95):.0f} % (n = {len(errors)})" if errors else "none")
    out["95 % intervals that hold the truth"] = share(covered)
    ratios = [r["after_over_floor"] for r in single if r["top"] and r["after_over_floor"]]
    out["held-out RMS after / floor, worst signal, median / p95"] = (
        f"{statistics.median(ratios):.3f} / {percentile(ratios, 95):.3f}" if ratios else "none")
    out.update(beside_the_oracle(strong + [r for r in rows if r["kind"] == "pair" and r["strength"] >= 3],
                                 [r for r in rows if r["kind"] == "without"]))
    out.update(transferred(clean, strong))
    seconds = [r["seconds"] for r in rows]
    out["processor time of a diagnosis, median / largest [s]"] = f"{statistics.median(seconds):.1f} / {max(seconds):.1f}"
    return out


def beside_the_oracle(strong, left_out):
    """Held against a diagnosis that knows which effects there are: what strong ones leave, and whether one that was left
    out of the library leaves so much less than what stands in for it that the record tells them apart: by what an
    effect must gain to be told, a thousandth of what noise leaves."""
    out = {}
    some = [r for r in strong if "oracle" in r]
    if some:
        worst = [max(v / r["oracle"]["rms"][s] for s, v in r["left"]["rms"].items() if r["oracle"]["rms"][s] > 0)
                 for r in some]
        all_signals = [math.sqrt(r["left"]["after"] / r["oracle"]["after"]) for r in some]
        for text, ratios in (("all signals", all_signals), ("worst signal", worst)):
            out[f"held-out RMS / oracle's, {text}, median / p95"] = (
                f"{statistics.median(ratios):.4f} / {percentile(ratios, 95):.4f} (n = {len(ratios)})")
    told_apart = [r for r in left_out if "oracle" in r and
                  (r["rejected"] or r["left"]["after"] - r["oracle"]["after"] > 1e-3 * r["left"]["noise"])]
    if left_out:
        out["left out of the library: not explained away, where the record tells it from what stands in"] = share(
            r["rejected"] for r in told_apart)
    return out


def transferred(clean, strong):
    """What models found on circles and lines leave of another piece's readings. Where the declared model is off by
    less than ten times what noise leaves, the share of it is about noise and says little of what was found."""
    out, of = {}, "circles to S piece"
    noise = [r["transfer_um"][1] for r in clean if "transfer_um" in r]
    some = [r["transfer_um"] for r in strong if "transfer_um" in r]
    if noise:
        out[f"{of}, clean machines: left, median / most"] = (
            f"{1e3 * statistics.median(noise):.0f} / {1e3 * max(noise):.0f} nm (n = {len(noise)})")
    if some:
        left = [after for _, after in some]
        out[f"{of}: left, median / p95"] = (
            f"{1e3 * statistics.median(left):.0f} / {1e3 * percentile(left, 95):.0f} nm (n = {len(some)})")
    least = {"": 0.0}
    if noise:
        seen = 10 * statistics.median(noise)
        least[f", where that is over {1e3 * seen:.0f} nm"] = seen
    for text, above in least.items():
        shares = [after / before for before, after in some if before > above]
        if shares:
            out[f"{of}: left of the declared model's{text}, median / p95"] = (
                f"{100 * statistics.median(shares):.1f} % / {100 * percentile(shares, 95):.0f} % (n = {len(shares)})")
    return out


def number_of(text):
    """12/13 (92.3 %) -> 0.923, None where nothing was drawn."""
    found = re.match(r"(\d+)/(\d+)", text)
    return int(found[1]) / int(found[2]) if found and int(found[2]) else None
