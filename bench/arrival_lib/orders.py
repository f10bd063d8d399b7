"""Orders in which the keyframes of several agents may arrive. Each agent's own keyframes stay in order."""

import random

SHIFTS = (-1, -0.5, -0.1, 0, 0.1, 0.5, 1)  # of all later agents, as shares of the session


def by_channel(events):
    channels = {}
    for event in events:
        channels.setdefault(event.channel, []).append(event)
    return channels


def shifted(events, share):
    """The first agent as captured, each further one later (or earlier) by a share of the session."""
    channels = by_channel(events)
    begin, end = min(event.utime for event in events), max(event.utime for event in events)
    by = round(share * (end - begin + 1))
    return [event.at(event.utime + by * index + (end - begin) * len(channels)) for index, channel in enumerate(sorted(channels)) for event in channels[channel]]


def shuffled(events, seed):
    """Whose keyframe comes next is drawn by lot."""
    channels = {channel: list(of_channel) for channel, of_channel in by_channel(events).items()}
    turns = [event.channel for event in events]
    random.Random(seed).shuffle(turns)
    times = sorted(event.utime for event in events)
    return [channels[channel].pop(0).at(utime) for channel, utime in zip(turns, times)]


def ten(events):
    """(name, events) of ten orders."""
    return [(f"shifted by {share:+g}", shifted(events, share)) for share in SHIFTS] + \
        [(f"shuffled, seed {seed}", shuffled(events, seed)) for seed in (1, 2, 3)]
