"""One set of mechanisms: likelihood, most probable parameters, evidence."""
