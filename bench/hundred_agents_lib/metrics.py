"""The results of a run: from the journals, and from logs of the agents' and the servers' buses."""

from link_lib.metrics import events, keyframes
from many_agents_lib.metrics import row, spread


def closed_loops(log, decode, group_of):
    """The keyframes with an accepted constraint to one of their group, and the number of accepted constraints."""
    ids, accepted = set(), 0
    for _, channel, data in events(log):
        if channel == "CONSTRAINT":
            constraint = decode(data)
            accepted += constraint.accepted
            to = constraint.to
            if constraint.accepted and constraint.from_.map.agent_id in group_of[to.map.agent_id]:
                ids.add((to.map.agent_id, to.map.opened_utime, to.seq))
    return ids, accepted


def corrected_s(log, keyframes_sent, decode):
    """Seconds from each of these keyframes on an agent's bus to the first correction that includes it: for keyframes sent before
    the agent's first correction, and for the others; and the number of keyframes without a correction."""
    waiting, first, others, first_utime = dict(keyframes_sent), [], [], None
    for utime, channel, data in events(log):
        if channel.startswith("CORRECTION_"):
            correction = decode(data)
            first_utime = first_utime or utime
            for key in [key for key in waiting if key[1] == correction.map.opened_utime and key[2] <= correction.seq]:
                sent = waiting.pop(key)
                (first if sent < first_utime else others).append(1e-6 * (utime - sent))
    return first, others, len(waiting)


def groups(log, decode):
    """The agents of each group, by the last state of each agent's map."""
    group_of = {}
    for _, channel, data in events(log):
        if channel == "MAP_STATE":
            agents = tuple(sorted({one.agent_id for one in decode(data).maps}))
            group_of.update({agent: agents for agent in agents})
    return sorted(map(list, set(group_of.values())))


def of_site(run, site, types):
    log = run.work / f"logs/{site.name}.lcm"
    journalled = keyframes(site.folder / "journal.lcm")
    found_groups = groups(log, types.map_state_t.decode)
    group_of = {agent: [agent] for agent in site.agents} | {agent: group for group in found_groups for agent in group}
    closed, accepted = closed_loops(log, types.constraint_t.decode, group_of)
    sent, first_s, late_s, without = {}, [], [], 0
    for agent in site.agents:
        of_agent = run.work / f"logs/agent_{agent}.lcm"
        when = {key: utime for key, (utime, _, _) in keyframes(of_agent).items()}
        first, late, left = corrected_s(of_agent, {key: when[key] for key in when if key in closed}, types.correction_t.decode)
        sent |= when
        first_s += first
        late_s += late
        without += left
    return {"sent": len(sent), "missing": len(set(sent) - set(journalled)),
            "strange": sum(agent not in site.agents for agent, _, _ in journalled),
            "first_s": first_s, "corrected_s": late_s, "not_corrected": without, "accepted": accepted,
            "groups": [[agent - site.agents[0] + 1 for agent in group] for group in found_groups]}


def metrics(run, types):
    sites = [of_site(run, site, types) for site in run.sites]
    expected = run.expected_groups()
    total = {name: sum(site[name] for site in sites) for name in ("sent", "missing", "strange", "not_corrected", "accepted")}
    return total | {
        "sites": len(sites), "agents": len(sites) * run.options.agents, "rate": run.options.rate, "took_s": round(run.took_s),
        "groups": expected, "sites_as_expected": sum(site["groups"] == expected for site in sites),
        "first": spread([s for site in sites for s in site["first_s"]]),
        "corrected": spread([s for site in sites for s in site["corrected_s"]]),
        "memory_mb": {name: of_processes(kb.values()) for name, kb in sorted(run.memory_kb.items())},
        "cpu_s": {name: round(sum(seconds.values()), 1) for name, seconds in sorted(run.cpu_s.items())},
    }


def of_processes(resident_kb):
    mb = sorted(1e-3 * kb for kb in resident_kb)
    return {"number": len(mb), "median": round(mb[len(mb) // 2], 1), "largest": round(mb[-1], 1)}


def is_good(found):
    nothing = found["missing"] == found["strange"] == found["not_corrected"] == 0
    return nothing and found["sites_as_expected"] == found["sites"]


def table(found):
    text = ("{agents} agents in {sites} sites at {rate} of real time: {sent} keyframes in {took_s} s, {missing} missing in their "
            "journals, {strange} in another's; {accepted} constraints accepted, {not_corrected} of their keyframes never "
            "corrected. The replay of a site's journal has the groups {groups}; so have {sites_as_expected} of {sites} sites.")
    lines = [text.format(**found), "",
             "| keyframes with a constraint, from sent to corrected | number | median ms | p99 ms | largest ms |",
             "|---|---|---|---|---|", row("before the agent's map is fused", found["first"]), row("after", found["corrected"]), "",
             "| process | number | resident MB, median | largest | CPU s of all |", "|---|---|---|---|---|",
             *("| {} | {number} | {median} | {largest} | {} |".format(name, found["cpu_s"][name], **mb)
               for name, mb in found["memory_mb"].items())]
    return "\n".join(lines) + "\n"
