"""The raw log of a control loop: one Arrow file with hierarchies, answers and memory as data.

Read the modules in this order:

    slots         fields of one tick in shared memory, and the columns of the file that are made of them
    ring          the memory that a loop and the writer share
    instructions  what the writer is told
    writer        the process that appends ticks to the file
    provenance    versions, machine, commit, text of the scenario
    description   fields, columns and metadata of a stack
    raw           `RawLog`, into which a loop copies its ticks
    of_plan       description and parts of a tick that a plan knows
    quick         the compiled copy of an ordinary tick
    own_loop      `record`, with which any other loop logs its ticks
    reading       `open_log`: arrays, names, units, ticks of a file, complete or cut off
    ticks         hierarchy, memory and resolution of a tick, made again from its row
    again         a tick solved again, with another resolver or changed
    spans         when bounds were active, and at which price
    breaches      which limits answers broke, and by how much
    claims        limits violated, answers unproven, deadlines missed
    difference    two logs beside each other
    export        CSV and Parquet
    story         a log in sentences
    report        a log as Markdown or as a page

The package itself imports none of them: a loop without a log does not load Arrow, and the writer loads
nothing of a robot.
"""
