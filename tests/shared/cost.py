"""What a piece of work costs, as a ratio to a peer: holds on a slow or shared machine, too."""

import time


def cost_ratio(work, peer, rounds=3):
    """Least CPU time of the work over the least of its peer, measured in turns."""
    spent = {work: [], peer: []}
    for _ in range(rounds):
        for call, times in spent.items():
            start = time.process_time()
            call()
            times.append(time.process_time() - start)
    return min(spent[work]) / min(spent[peer])
