"""Entity paths of all quantities in a recording, and names that are valid parts of a path."""

import re

import rerun as rr

EVENTS = "/run/events"
SUMMARY = "/run/summary"
RANGE = "/scale/range"
PROOF = "/scale/proof"


def resolver_part(resolver: str) -> str:
    """Convert the name of a resolver to one part of a path.

    Args:
        resolver: The name, such as "hqp/daqp".

    Returns:
        The name without slashes, such as "hqp-daqp".
    """
    return resolver.replace("/", "-")


def escaped_part(name: str) -> str:
    """Convert any name to one part of a path, which Rerun reads back as the same name.

    Args:
        name: The name; it may contain spaces and slashes.

    Returns:
        The name with Rerun's escapes.
    """
    return rr.escape_entity_path_part(name)


def plain_part(name: str) -> str:
    """Convert any name to one part of a path without escapes, which can also be a title.

    Args:
        name: The name, such as "panda_link5 – left ball".

    Returns:
        The name in letters, digits, dots, hyphens and underscores, such as "panda_link5-left_ball".
    """
    return re.sub(r"[^\w.-]+", "_", name.replace(" – ", "-"))


def data_path(resolver: str, *names: str) -> str:
    """Return the path of a quantity of a resolver, such as its velocities.

    Args:
        resolver: The name of the resolver.
        *names: The kind of quantity, then the names of task, limit or row, in that order.

    Returns:
        A path below /resolver.
    """
    return "/".join((f"/resolver/{resolver_part(resolver)}", *map(escaped_part, names)))


def closed_form_path(resolver: str) -> str:
    """Return the path of the distance between a resolver's answer and its closed-form answer.

    Args:
        resolver: The name of the resolver.

    Returns:
        A path below /compare.
    """
    return f"/compare/{resolver_part(resolver)}-closed_form/v"


def world_path(resolver: str, *names: str) -> str:
    """Return the path of an object in the scene of a resolver's robot.

    Args:
        resolver: The name of the resolver.
        *names: The kind of thing, then its name and parts, in that order.

    Returns:
        A path below /world.
    """
    return "/".join((f"/world/{resolver_part(resolver)}", *map(escaped_part, names)))


def least_distance_path(resolver: str, limit: str) -> str:
    """Return the path of the least distance of all pairs of a distance limit.

    Args:
        resolver: The name of the resolver.
        limit: The name of the limit.

    Returns:
        A path below /resolver.
    """
    return data_path(resolver, "least_distance", limit)


def pair_path(resolver: str, limit: str, pair: str) -> str:
    """Return the path of the distance of one pair of a distance limit.

    Args:
        resolver: The name of the resolver.
        limit: The name of the limit.
        pair: The name of the pair.

    Returns:
        A path below `all_pairs_path`.
    """
    return data_path(resolver, "distance", limit, pair)


def all_pairs_path(resolver: str, limit: str) -> str:
    """Return the pattern of the paths of all pairs of a distance limit.

    Args:
        resolver: The name of the resolver.
        limit: The name of the limit.

    Returns:
        A pattern for the content of a view.
    """
    return data_path(resolver, "distance", limit) + "/**"


def margin_path(limit: str) -> str:
    """Return the path of the margin of a distance limit, the same for all resolvers.

    Args:
        limit: The name of the limit.

    Returns:
        A path below /scale.
    """
    return f"/scale/margin/{escaped_part(limit)}"
