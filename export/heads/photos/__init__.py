"""Real faces for the encoder of heads: what a teacher sees of them in photographs, as sparse labels."""
