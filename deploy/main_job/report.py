"""Turns what the main job measured into a table, report.json and report.html."""

import html
import json
import math

import yaml

import pictures

FULL_COLOUR_MM = 0.6


def percentile(values, share):
    """Nearest-rank percentile; 0 for nothing."""
    ordered = sorted(values)
    if not ordered:
        return 0.0
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


def rows(values, stride):
    return [tuple(values[i : i + stride]) for i in range(0, len(values) - stride + 1, stride)]


class Stage:
    """One cut: what was predicted, what was found, what the job recorded."""

    def __init__(self, name, job, prediction, found, report):
        self.name = name
        self.job = job
        self.prediction = prediction
        self.found = found
        self.report = report
        self.events = rows(report.event_deviations, 3)

    def figures(self):
        sizes = [abs(event[2]) for event in self.events]
        return {
            "name": self.name,
            "p95_mm": self.found.all.p95_mm,
            "max_mm": self.found.all.max_mm,
            "p50_mm": self.found.all.p50_mm,
            "predicted_95_mm": self.prediction.predicted_95_mm,
            "prediction_holds": self.found.all.p95_mm <= self.prediction.predicted_95_mm,
            "cutting_time_s": self.found.cutting_time_s,
            "job_time_s": self.report.duration_s,
            "event_deviation_p50_mm": percentile(sizes, 0.50),
            "event_deviation_p99_mm": percentile(sizes, 0.99),
            "events_in_motion": len(sizes),
            "interruptions": self.report.interruptions,
            "drive_overruns": self.report.drive_overruns,
            "main_motion_overruns": self.report.main_motion_overruns,
            "points_not_cut": self.found.all.not_cut,
            "truth_missing_ms": self.found.missing,
            "model_version": self.job.model_version.version,
            "features": [
                {
                    "name": f.name,
                    "p95_mm": f.p95_mm,
                    "max_mm": f.max_mm,
                    "mean_mm": f.mean_mm,
                    "tolerance_mm": f.tolerance_mm,
                    "conforming": f.conforming,
                }
                for f in self.found.features
            ],
        }


def with_sigma(value, sigma):
    """A value with as many digits as its uncertainty allows: two of sigma's."""
    if sigma <= 0:
        return f"{value:g}"
    digits = max(0, 1 - math.floor(math.log10(sigma)))
    return f"{value:.{digits}f} ± {sigma:.{digits}f}"


def as_json(run):
    """The whole result as one object; the same figures as the table."""
    return {
        "part": run.part_name,
        "plant": run.plant_name,
        "seed": run.seed,
        "stages": [stage.figures() for stage in run.stages],
        "model_versions": run.model_versions,
        "verification": run.verification,
        "identification": run.identification,
        "ready_s": run.ready_s,
        "resident_mib": {"idle": run.resident_idle, "after": run.resident_after},
        "timer_jitter_us": run.timer_jitter_us,
        "containers": run.containers,
    }


def table(run):
    lines = [
        f"{'stage':<28}{'p95 mm':>9}{'max mm':>9}{'predicted 95 % mm':>19}{'cutting s':>11}",
        "-" * 76,
    ]
    for stage in run.stages:
        f = stage.figures()
        holds = " " if f["prediction_holds"] else "!"
        lines.append(
            f"{f['name']:<28}{f['p95_mm']:>9.3f}{f['max_mm']:>9.3f}{f['predicted_95_mm']:>18.3f}{holds}{f['cutting_time_s']:>11.1f}"
        )
    sizes = [abs(event[2]) for stage in run.stages for event in stage.events]
    lines.append("")
    lines.append(
        f"process events in motion: {len(sizes)}, deviation median {percentile(sizes, 0.5):.4f} mm, 99 % {percentile(sizes, 0.99):.4f} mm"
    )
    if run.timer_jitter_us:
        jitter = run.timer_jitter_us
        lines.append(
            f"timer of this machine while cutting: median {jitter['p50']} µs, 99 % {jitter['p99']} µs, worst {jitter['max']} µs late"
        )
    lines.append(f"all seven ready after {run.ready_s:.2f} s; memory MiB idle/after: " + memory_words(run))
    return "\n".join(lines)


def memory_words(run):
    names = [name for name in run.resident_idle if name != "inspection"]
    return ", ".join(f"{name} {run.resident_idle[name]:.0f}/{run.resident_after.get(name, 0):.0f}" for name in names)


def write(run, folder):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "report.json").write_text(json.dumps(as_json(run), indent=2) + "\n")
    drawn = draw(run)
    for name, svg in drawn.items():
        (folder / f"{name}.svg").write_text(svg)
    (folder / "report.html").write_text(as_html(run, drawn))


def holes_of(run, stage):
    """Indices of the stage's features that are holes in the drawing."""
    holes = {f["name"] for f in yaml.safe_load(run.drawing)["features"] if f.get("kind") == "hole"}
    return {i for i, feature in enumerate(stage.found.features) if feature.name in holes}


def draw(run):
    drawn = {}
    for i, stage in enumerate(run.stages):
        deviations = rows(stage.found.deviations, 4)
        if deviations:
            drawn[f"part_{i + 1}"] = pictures.part(stage.name, deviations, holes_of(run, stage), 10, FULL_COLOUR_MM)
    drawn["budget"] = pictures.budget(
        [(s.name, [(share.source, share.contribution_95_mm) for share in s.prediction.budget]) for s in run.stages]
    )
    last = run.stages[-1]
    trace = rows(last.report.slider_trace, 6)
    colours = ("#32608f", "#b36b00")
    drawn["slider_positions"] = pictures.curves(
        f"Slider positions, {last.name}",
        "mm",
        [(f"slider {k + 1}", colours[k], [(row[0], row[1 + k]) for row in trace]) for k in range(2)],
    )
    drawn["slider_speeds"] = pictures.curves(
        f"Slider speeds, {last.name}",
        "mm/s",
        [(f"slider {k + 1}", colours[k], [(row[0], row[3 + k]) for row in trace]) for k in range(2)],
    )
    every = [event[2] for stage in run.stages for event in stage.events]
    drawn["events"] = pictures.histogram(
        "Process events in motion: how far from their place on the path",
        every,
        [("median asked 20 µm", 0.02), ("99 % asked 100 µm", 0.1)],
    )
    return drawn


STYLE = """
body { font: 15px/1.5 sans-serif; color: #1b2733; max-width: 980px; margin: 2em auto; padding: 0 1em; }
table { border-collapse: collapse; margin: 1em 0; } th, td { padding: .3em .8em; text-align: right; border-bottom: 1px solid #d7dee5; }
th:first-child, td:first-child { text-align: left; } figure { margin: 1.5em 0; } .bad { color: #b3261e; font-weight: bold; }
svg { max-width: 100%; height: auto; }
"""


def as_html(run, drawn):
    stage_rows = "".join(
        "<tr><td>{}</td><td>{:.3f}</td><td>{:.3f}</td><td>{:.3f}</td><td>{}</td><td>{:.1f}</td><td>{:.4f}</td><td>{:.4f}</td></tr>".format(
            html.escape(f["name"]),
            f["p95_mm"],
            f["max_mm"],
            f["predicted_95_mm"],
            "held" if f["prediction_holds"] else '<span class="bad">missed</span>',
            f["cutting_time_s"],
            f["event_deviation_p50_mm"],
            f["event_deviation_p99_mm"],
        )
        for f in (stage.figures() for stage in run.stages)
    )
    found = [p for p in run.identification.get("parameters", []) if p["after_sigma"] > 0]
    held = [p["name"] for p in run.identification.get("parameters", []) if p["after_sigma"] <= 0]
    parameters = "".join(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{:+.3g}</td><td>{}</td></tr>".format(
            html.escape(p["name"]), with_sigma(p["before"], p["before_sigma"]), with_sigma(p["after"], p["after_sigma"]),
            p["after"] - p["before"], html.escape(p["unit"])
        )
        for p in found
    )
    held_words = f"<p>Held as designed: {html.escape(', '.join(held))}.</p>" if held else ""
    features = "".join(
        "<tr><td>{}</td>{}</tr>".format(
            html.escape(run.stages[0].found.features[i].name),
            "".join(
                f"<td>{stage.found.features[i].p95_mm:.3f}</td>" for stage in run.stages if i < len(stage.found.features)
            ),
        )
        for i in range(len(run.stages[0].found.features))
    )
    figures = {name: f"<figure>{svg}</figure>" for name, svg in drawn.items()}
    parts = "".join(figures[name] for name in sorted(figures) if name.startswith("part_"))
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Lambdajet: {html.escape(run.part_name)}</title><style>{STYLE}</style></head><body>
<h1>{html.escape(run.part_name)}, cut three times</h1>
<p>Plant {html.escape(run.plant_name)}, seed {run.seed}. Every figure was measured in this run; deviation is the distance of the cut
edge from the drawing along the outline's normal, without any fit. The predicted bound should lie above the 95th percentile.</p>
<table><tr><th>stage</th><th>p95 mm</th><th>max mm</th><th>predicted 95 % mm</th><th></th><th>cutting s</th><th>Δs p50 mm</th><th>Δs p99 mm</th></tr>{stage_rows}</table>
<h2>The part and its deviation</h2>{parts}
<h3>95th percentile by feature, mm</h3>
<table><tr><th>feature</th>{"".join(f"<th>{html.escape(s.name)}</th>" for s in run.stages)}</tr>{features}</table>
<h2>Where the error comes from</h2>{figures["budget"]}
<h2>Identification</h2>
<p>Before the first cut, verification said {html.escape(run.verification.get("verdict", ""))}:
{html.escape(run.verification.get("message", ""))}.</p>
<p>{html.escape(run.identification.get("words", ""))}</p>
<table><tr><th>parameter</th><th>before</th><th>identified</th><th>change</th><th>unit</th></tr>{parameters}</table>{held_words}
<h2>Sliders</h2>{figures["slider_positions"]}{figures["slider_speeds"]}
<h2>Process events</h2>{figures["events"]}
<pre>{html.escape(table(run))}</pre>
</body></html>
"""
