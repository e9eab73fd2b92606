"""Proof of an answer: a bound on the error of x, and the verdict that follows from it.

`docs/certificate.md` states and proves the theorem, and derives the rounding constants.
"""

from taskopt.hierarchy.proof.judgement import UNDECIDED as UNDECIDED
from taskopt.hierarchy.proof.judgement import Judgement as Judgement
from taskopt.hierarchy.proof.judgement import Verdict as Verdict
from taskopt.hierarchy.proof.judging import Judge as Judge
from taskopt.hierarchy.proof.judging import judge as judge
from taskopt.hierarchy.proof.prover import Optimum as Optimum
from taskopt.hierarchy.proof.prover import prove as prove
