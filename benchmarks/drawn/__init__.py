"""What the transformer draws of coming frames, beside the last frame and motion."""

OF_TIMES = ("four_samples_times", "drawn_frames_a_second", "passes_frames_a_second", "recomputing_times")
FIGURES = (
    "drawn_mean_gain_db",
    "mended_gain_db",
    "uncertainty_rank",
    "drawn_frechet_ratio",
    "mended_frechet_ratio",
    *OF_TIMES,
)
