"""The figures of the chapter, drawn from our robots, analyses and runs.

Each figure is a function without arguments that returns a Matplotlib figure; `catalogue` knows them by their
numbers and writes them to files. The package needs the extra `taskopt[figures]`.
"""
