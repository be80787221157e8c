"""Pictures of the stand-off loop: responses, frequency response, root locus, phase portrait."""
