"""Measures frames that the transformer samples, beside the last frame and motion."""

OF_TIMES = ("four_samples_times", "sampled_frames_a_second")
METRICS = (
    "sampled_mean_gain_db",
    "uncertainty_rank",
    "sampled_frechet_ratio",
    *OF_TIMES,
)
