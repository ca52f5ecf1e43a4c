"""Runs as tables in markdown.

In: the object that main.py writes as JSON. Out: what each program took, how many times as much crease took, what a second
thread is worth, and where the time of crease goes. Numbers are medians over the rounds; ratios are formed within a round,
so that both of their parts had the same machine, and come with their range.
"""

from statistics import median

# More than this part of a processor for others, and wall times are not those of the program.
QUIET = 0.1


def markdown(everything):
    runs = everything["runs"]
    done = [run for run in runs if run["outcome"] == "done"]
    parts = [
        head(everything, done),
        taken(runs, done),
        ratios(done),
        threads(done),
        stages(done),
    ]
    return "\n".join(part for part in parts if part)


def head(everything, done):
    machine = everything["machine"]
    lines = [
        f"{machine['processor']}, {machine['threads']} threads, {size(machine['memory'])} of memory, "
        f"Linux {machine['kernel']}; threshold of the peers {everything['angle']:g} degrees.",
    ]
    if done:
        most = max(run["others"] for run in done)
        typical = median(run["others"] for run in done)
        loads = [run["load"] for run in done]
        lines.append(
            f"Other work on the machine took {typical:.2f} processors in the median over the runs, {most:.2f} at most; "
            f"load averages before the runs {min(loads):.1f} to {max(loads):.1f}."
        )
        if typical > QUIET:
            lines.append("**The machine was not idle: wall times are too long, processor times less so.**")
    said = {run["program"]: run["version"] for run in done if run.get("version")}
    lines.append("")
    for program in everything["programs"]:
        version = program["version"] or said.get(program["name"], "")
        lines.append(f"- {program['name']}: `{program['command']}`, {version or 'did not run'}")
    return "\n".join(lines) + "\n"


def grid(columns, rows):
    """Text columns are marked by a name that begins with a dash."""
    rule = ["---" if column.startswith("-") else "---:" for column in columns]
    lines = [[column.lstrip("-") for column in columns], rule, *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def unique(items):
    return list(dict.fromkeys(items))


def of(runs, mesh, program):
    return sorted(
        (run for run in runs if (run["mesh"], run["program"]) == (mesh, program)), key=lambda run: run["repeat"]
    )


def pairs(runs):
    return unique((run["mesh"], run["program"]) for run in runs)


def middle(runs, key):
    return median(key(run) for run in runs)


def part(name, clock):
    """Seconds of one part of a peer; 0 for crease, which has none."""
    return lambda run: run.get("parts", {}).get(name, {}).get(clock, 0.0)


def bare(clock):
    """What a peer is compared by: reading and finding, without the start and the end of its interpreter."""
    return lambda run: part("read", clock)(run) + part("edges_found", clock)(run)


def taken(runs, done):
    columns = [
        "-mesh", "-program", "triangles", "wall s", "CPU s", "start", "read", "find", "peak RSS", "anonymous", "found",
    ]
    rows = []
    for mesh, program in pairs(runs):
        fine = of(done, mesh, program)
        if not fine:
            run = of(runs, mesh, program)[0]
            rows.append([mesh, program, f"{run['faces']}", *["-"] * 7, run["outcome"].replace("|", "/")])
            continue
        has_parts = "parts" in fine[0]
        cpu_of = [f"{middle(fine, part(n, 'cpu')):.2f}" if has_parts else "-" for n in ("start", "read", "edges_found")]
        rows.append([
            mesh,
            program,
            f"{fine[0]['faces']}",
            f"{middle(fine, lambda r: r['wall']):.2f}",
            f"{middle(fine, lambda r: r['cpu']):.2f}",
            *cpu_of,
            size(middle(fine, lambda r: r["resident"])),
            size(middle(fine, lambda r: r["anonymous"])),
            " or ".join(unique(run["found"] for run in fine)),
        ])
    return "What each took; start, read and find are processor seconds of parts.\n\n" + grid(columns, rows)


def is_crease(program):
    return program.startswith("crease")


def ratios(done):
    ours = sorted({run["program"] for run in done if is_crease(run["program"])})
    peers = unique(run["program"] for run in done if not is_crease(run["program"]))
    if not ours or not peers:
        return ""
    first, *_ = ours
    columns = ["-mesh", "-peer", "CPU", *(f"wall: {name}" for name in ours), "peak RSS", "anonymous"]
    rows = []
    for mesh in unique(run["mesh"] for run in done):
        for peer in peers:
            theirs = of(done, mesh, peer)
            against = lambda name, key, their_key: ratio(of(done, mesh, name), theirs, key, their_key)
            alike = [lambda run, key=key: run[key] for key in ("resident", "anonymous")]
            rows.append([
                mesh,
                peer,
                against(first, lambda run: run["cpu"], bare("cpu")),
                *(against(name, lambda run: run["wall"], bare("wall")) for name in ours),
                *(against(first, key, key) for key in alike),
            ])
    return (
        f"crease / peer: the whole process of crease, output included, against reading and finding alone of the peer; "
        f"memory of whole processes. CPU and memory are those of {first}. Median (least-most) over the rounds.\n\n"
    ) + grid(columns, rows)


def ratio(ours, theirs, key, their_key):
    theirs = {run["repeat"]: their_key(run) for run in theirs}
    found = [key(run) / theirs[run["repeat"]] for run in ours if theirs.get(run["repeat"])]
    return spread(found, "{:.3g}") if found else "-"


def spread(values, form):
    """The median, and between which it lies where there are several."""
    middle = form.format(median(values))
    if len(values) == 1:
        return middle
    return f"{middle} ({form.format(min(values))}-{form.format(max(values))})"


def threads(done):
    """Wall = s + p / n for n threads, solved for the serial part s from one thread and two."""
    columns = ["-mesh", "wall s, 1 thread", "wall s, 2 threads", "ratio", "serial part %", "CPU s 2 / 1"]
    rows = []
    for mesh in unique(run["mesh"] for run in done):
        one, two = ({run["repeat"]: run for run in of(done, mesh, f"crease, {n}")} for n in ("1 thread", "2 threads"))
        both = [(one[repeat], two[repeat]) for repeat in one if repeat in two]
        if not both:
            continue
        speedups = [a["wall"] / b["wall"] for a, b in both]
        serial = [100 * (2 * b["wall"] - a["wall"]) / a["wall"] for a, b in both]
        rows.append([
            mesh,
            f"{median(a['wall'] for a, _ in both):.2f}",
            f"{median(b['wall'] for _, b in both):.2f}",
            spread(speedups, "{:.2f}"),
            spread(serial, "{:.0f}"),
            f"{median(b['cpu'] / a['cpu'] for a, b in both):.2f}",
        ])
    if not rows:
        return ""
    return "What a second thread is worth; the serial part is that of the time of one thread.\n\n" + grid(columns, rows)


def stages(done):
    ours = [run for run in done if run.get("stages")]
    names = unique(stage["stage"] for run in ours for stage in run["stages"])
    rows = []
    for mesh, program in pairs(ours):
        fine = of(ours, mesh, program)
        cells = [mesh, program]
        for name in [*names, None]:
            of_run = lambda run: sum(s["cpu"] for s in run["stages"] if s["stage"] == name or name is None)
            cells.append(f"{1e9 * middle(fine, of_run) / fine[0]['faces']:.0f}")
        rows.append([*cells, f"{1e9 * middle(fine, lambda r: r['cpu']) / fine[0]['faces']:.0f}"])
    if not rows:
        return ""
    columns = ["-mesh", "-program", *names, "all stages", "whole process"]
    return "Stages of crease, in nanoseconds of processor time for each triangle.\n\n" + grid(columns, rows)


def size(bytes):
    """Bytes in a unit that leaves few digits."""
    units = [("GiB", 2**30), ("MiB", 2**20), ("KiB", 2**10)]
    name, unit = next(((n, u) for n, u in units if bytes >= u), ("B", 1))
    return f"{bytes / unit:.1f} {name}"
