"""What limits the feed of a plan, as rows for a report: the table that `lambdajet trajectory show` prints."""

COLUMNS = ("line", "from s mm", "to s mm", "programmed mm/s", "lowest mm/s", "because", "reaches", "at s mm", "over %")


def slow_rows(summary):
    """A row for each stretch of a PlanSummary where the programmed feed is not held. What is not measured (a hexapod's plan) is None."""
    return [
        (
            slow.line,
            slow.from_s_mm,
            slow.to_s_mm,
            slow.programmed_mm_per_s,
            slow.lowest_mm_per_s,
            slow.limit,
            f"{100 * slow.reached_share:.1f} % of {slow.nearest}" if slow.HasField("reached_share") else None,
            slow.at_s_mm if slow.HasField("at_s_mm") else None,
            100 * slow.share if slow.HasField("share") else None,
        )
        for slow in summary.slow_stretches
    ]
