"""The tables, as Markdown and as JSON."""

from real_lib.funnel import table

HEAD = ["| | ATE m, own scale | of the path | scale | scale of each piece | drift of scale | coverage | clock ms | "
        "revisits: pairs, error | a second: error | maps |", "|---|---|---|---|---|---|---|---|---|---|---|"]
CONSTRAINTS_HEAD = ["| | accepted | of revisits | refused | switched off | checked | wrong | median error | NEES: number, mean, median | of cycles | "
                    "most frequent refusals |", "|---|---|---|---|---|---|---|---|---|---|---|"]


def number(value, form):
    return "–" if value is None else format(value, form)


def error(medians):
    return "–" if medians["median_m"] is None else f"{medians['median_m']:.3f} m {medians['median_deg']:.2f}°"


def nees(values):
    return f"{values['number']}: {values['mean']:.1f}, {values['median']:.1f}" if values["number"] else "–"


def row(name, r):
    if not r:
        return f"| {name} | no value | | | | | | | | | |"
    again = r["revisits"]
    revisits = f"{again['pairs']}, {error(again)}" if again["pairs"] else "0"
    return (f"| {name} | {r['ate_m']:.4f} | {number(r['ate_share'], '.2%')} | {r['scale']:.3f} | "
            f"{', '.join(f'{s:.3f}' for s in r['piece_scales'])} | {number(r['drift'], '.3f')} | {r['coverage']:.2f} | "
            f"{1e3 * r['shift_s']:.0f} | {revisits} | {error(r['a_second'])} | {r['maps']} |")


def constraints_row(name, c):
    reasons = sorted(c["refused_by_reason"].items(), key=lambda item: -item[1])[:3]
    return (f"| {name} | {c['accepted']} | {c['revisits']} | {c['refused']} | {c['switched_off']} | {c['checked']} | {c['wrong']} | "
            f"{error(c)} | {nees(c['nees'])} | {nees(c['cycles'])} | {', '.join(f'{count} {reason}' for reason, count in reasons)} |")


def spread(rows):
    """The largest scale divided by the smallest; None for fewer than two."""
    scales = [r["scale"] for r in rows if r]
    return max(scales) / min(scales) if len(scales) > 1 and min(scales) > 0 else None


class Tables:
    def __init__(self, plan, results):
        options = plan.options
        self.rows = {}
        for start in options.starts:
            at = f"from {start:g} s" if len(options.starts) > 1 else ""
            self.rows[f"odometry {at}".strip()] = results.vio(start)
            self.rows[f"with server {at}".strip()] = results.server(start)
        for order in ("AB", "BA") if options.halves else ():
            self.rows[f"halves, {'←'.join(order)}"] = results.halves(order)
        for name, file in options.other:
            self.rows[name] = results.other(file)
        self.spreads = {kind: spread([r for name, r in self.rows.items() if name.startswith(kind)]) for kind in ("odometry", "with server")}
        self.name = plan.source.name
        self.funnels = results.funnels()

    def text(self):
        served = {name: r for name, r in self.rows.items() if r and "constraints" in r}
        lines = [f"# {self.name}", "", *HEAD, *(row(name, r) for name, r in self.rows.items()), ""]
        lines += [f"Spread of scale between starts, {kind}: {value:.3f}." for kind, value in self.spreads.items() if value]
        lines += ["", *CONSTRAINTS_HEAD, *(constraints_row(name, r["constraints"]) for name, r in served.items()), ""]
        lines += [f"{name}: {'fused' if r['fused'] else 'not fused'}." for name, r in served.items() if name.startswith("halves")]
        lines += ["", table(self.funnels)] if self.funnels else []
        return "\n".join(lines) + "\n"

    def json(self):
        return {"recording": self.name, "rows": self.rows, "scale_spread": self.spreads, "funnels": self.funnels}
