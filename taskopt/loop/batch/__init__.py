"""One stack for many arms at once: `controller` has the class, `lockstep` the compiled call."""
