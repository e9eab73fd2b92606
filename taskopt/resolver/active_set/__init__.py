"""`active-set`: the exact lexicographic optimum of a hierarchy, tick by tick.

The problem (see `taskopt.hierarchy.problem`), level 0 being the hard rows and level p + 1 the norm:

    lex min ( ½ Σ w_i d_i(x)² of level 1, …, of level p, ½ xᵀ W x )
    s.t.    box_lower ≤ x ≤ box_upper,  lower_0 ≤ A_0 x ≤ upper_0.

Symbols (kernels use the names of the last column):

    A       rows, all levels stacked, (M, n)                                     A
    W       working set: unknowns and rows that are held at a bound, (n + M,)    state (a `Held` each)
    x       primal: the unknowns, (n,)                                           x, here.x, goal.x
    L, Q    factors of the rows in W on the free unknowns, A = L Qᵀ              L, reflectors and beta
    z       coordinates Qᵀ x of the free unknowns; each level decides a part     z
    λ       multipliers of box and rows, one line a level, (p + 1, n + M)        multipliers
    α       step towards the solution of W, 0 ≤ α ≤ 1                            alpha

The algorithm. E is Escande, Mansard and Wieber (2014), "Hierarchical quadratic programming: Fast online
humanoid-robot motion generation", Int. J. Robotics Research 33(7); its algorithms are numbered as in the
authors' own preprint and code. D is Dimitrov, Sherikov and Wieber (2015), "Efficient resolution of
potentially conflicting linear constraints in robotics". Equations are cited by section, not by number.

    tick(problem, history):                                                      tick.tick
        W ← last working set                                                     tick._recall          [a]
        repeat at most 4 times:                                                  fast_path.fast_path   [b]
            solve the closed form with the box bounds in W; accept it, or let one bound change its side
        if it was not accepted:
            W, x, λ ← search(W)                                                  search.search
        residuals ← certificate of (x, λ) on the rows as declared                hierarchy.certificate
        if they are too large: once more from the empty W, certify again                               [c]
        if x keeps moved bounds: on from W, with the true ones                   resolver.search_on    [e]
        if they still are, or rows of W nearly depend on each other:
            x ← enclosure of the optimum that W leads to             resolver.take_enclosed            [k]
        if there is no answer yet: without haste; then coarsely              resolver.search_further   [m]

    search(W):                                                    E Sect. 5, Algorithm 6
        scale rows by √w and unknowns by √W                                      search._scaled
        first search: iterate(W)                                                 search._iterate
        if it has found nothing in 150 factorisations:
            move the bounds apart, start where all hard rows hold, iterate       search._second_search [d]
            solve W once more with the true bounds                           search._resolve_true_bounds   [e]

    iterate(W):
        loop:
            A = L Qᵀ of the rows in W, level by level             D Sect. 3      lexls.factorise
            goal ← each level's part of z in least squares, then x = Q z
                                                     D Sect. 3, E Algorithm 1    lexls.solve_levels
            λ ← of each level, back through the levels before it
                                                     D Sect. 3, E Algorithm 2    lexls.multipliers_of_level
            in the first round: if goal violates a row outside W, add all such rows, start beside it   [f]
            α ← the first row outside W that blocks the way from x to goal
                                                     E Algorithm 5               search._first_blocking
            x ← x + α (goal − x)
            if a row blocks: add it to W                                                               [g]
            else: of the first level with a wrong sign, drop the worst row from W
                                                     E Sect. 5, D Sect. 2        search._row_to_drop   [h]
                  if no sign is wrong: done; infeasible if a hard row keeps a residual
                  if W and the locks have been here before: this search cycles, give it up cycles.repeats [l]

A member of W may stay if its own residual, then its multiplier at each later level, is lexicographically
positive on its side. To drop several rows at once, or at a later level than the first wrong one, makes the
search cycle. Rows that depend on others of their level or before get the multiplier 0.

Our own heuristics have no counterpart in E and D. A search in exact arithmetic on a problem without ties
needs none of them, and none can make a wrong answer pass, since its KKT residuals are looked at. The tests
in tests/resolver/active_set/test_heuristics.py that fail without one of them carry its letter ([a] is tested
in test_resolver.py, [k] in test_scaled.py; [h] has no such test: of 3,000 hierarchies with nearly opposed
rows, one ends elsewhere without it):

    [a] alternation      where ticks alternate between two working sets, start from the last but one
    [b] fast path        the closed form of `fast_path`, with four attempts and one refinement
    [c] second start     a search whose answer misses its KKT conditions is repeated from an empty working set
    [d] perturbation     bounds that tie are moved apart by SEARCH_PERTURBATION (Charnes 1952)
    [e] true bounds      the perturbation is taken out of the answer
    [f] joint start      all rows that the first point violates join W at once; E adds them one by one
    [g] lock             a row that was dropped and blocks the next step at once stays until x moves
    [h] rounding bound   a multiplier counts from SEARCH_SIGN times its terms, not from zero: the magnitudes
                         that it is the difference of, times |L⁻ᵀ|, by which rounding grows on the way to it
    [i] other bound      a two-sided row that is dropped beyond its other bound is held there
    [j] second fit       an x that misses its KKT conditions gets other multipliers, found for it
    [k] enclosure        where digits are lost, x comes from the double-double numbers of a proof
    [l] cycles           a search that stands where it stood before is given up at once
    [m] last searches    without an answer, a search has many factorisations with the true bounds; in the next
                         ones, multipliers that no certificate can tell from rounding are zero, and so is
                         what is left of rows that depend on the levels before

Reading order: `workspace` (records and codes), `search`, `lexls`, `start`, `cycles`, `fast_path`, `linalg`,
`tick`, `resolver`.
"""
