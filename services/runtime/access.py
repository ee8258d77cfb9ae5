"""The hub's access rules, generated from the roles, and the same said in words.

Zenoh refuses silently: a message that may not pass is gone, and nobody hears of it. So whoever
connects asks first what it may do. Flows are as the hub sees them: ingress comes from a client,
egress goes to it.
"""

from collections.abc import Iterable
from typing import Any

from schemas.fleet import Access
from schemas.topics import ALL_QUERIES, ALL_TOPICS, ANY_ROBOT, LAST, READY, RUN, full_key
from services.roles import LOCAL, ROLES, Role

LOCAL_PROTOCOL = "unixsock-stream"
"""Only the user who started the hub can open its socket."""
_everything = (
    "put",
    "delete",
    "declare_subscriber",
    "query",
    "reply",
    "declare_queryable",
    "liveliness_token",
    "liveliness_query",
    "declare_liveliness_subscriber",
)
_no_topics = Access(role="nobody", publishes=(), listens=())


def access_control(realm: str, robot: str) -> dict[str, Any]:
    """Zenoh's setting `access_control` for the hub of one realm.

    A role's `delete` is refused like all that is not listed: it would reach subscribers.
    """
    rules = [rule for role in ROLES for rule in _rules(role, realm, robot)]
    local = _rule(LOCAL, _everything, ("ingress", "egress"), ["**"])
    subjects = [
        {"id": role.name, "cert_common_names": [role.name], "link_protocols": ["tls"]}
        for role in ROLES
    ]
    policies = [
        {"rules": [rule["id"] for rule in _rules(role, realm, robot)], "subjects": [role.name]}
        for role in ROLES
    ]
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": [*rules, local],
        "subjects": [*subjects, {"id": LOCAL, "link_protocols": [LOCAL_PROTOCOL]}],
        "policies": [*policies, {"rules": [LOCAL], "subjects": [LOCAL]}],
    }


def access_of(common_name: str | None) -> Access:
    """What the rules say about who came with this certificate; None came without."""
    if common_name is None:
        keys = tuple(topic.key for topic in ALL_TOPICS)
        return Access(role=LOCAL, publishes=keys, listens=keys)
    for role in ROLES:
        if role.name == common_name:
            return Access(
                role=role.name,
                publishes=tuple(topic.key for topic in role.publishes),
                listens=tuple(topic.key for topic in role.listens),
            )
    return _no_topics


def _rules(role: Role, realm: str, robot: str) -> list[dict[str, Any]]:
    def keys(names: Iterable[str], prefix: str = "") -> list[str]:
        return [full_key(realm, robot, prefix + name) for name in names]

    says = [topic.key for topic in role.publishes]
    hears = [topic.key for topic in role.listens]
    kept = [topic.key for topic in (*role.listens, *role.publishes) if topic.keep_last]
    asks = [
        *keys(query.key for query in ALL_QUERIES),
        full_key(realm, ANY_ROBOT, RUN.key),
        *keys(dict.fromkeys(kept), f"{LAST}/"),
    ]
    wanted = [
        _rule(f"{role.name} says", ["put"], ["ingress"], keys(says)),
        _rule(f"{role.name} listens", ["declare_subscriber"], ["ingress"], keys(hears)),
        _rule(f"{role.name} hears", ["put"], ["egress"], keys(hears)),
        _rule(f"{role.name} asks", ["query"], ["ingress"], asks),
        _rule(f"{role.name} is told", ["reply"], ["egress"], asks),
        _rule(
            f"{role.name} is there",
            ["liveliness_token"],
            ["ingress"],
            keys(role.services, f"{READY}/"),
        ),
    ]
    return [rule for rule in wanted if rule["key_exprs"]]


def _rule(
    name: str, messages: Iterable[str], flows: Iterable[str], keys: Iterable[str]
) -> dict[str, Any]:
    return {
        "id": name,
        "messages": list(messages),
        "flows": list(flows),
        "permission": "allow",
        "key_exprs": list(keys),
    }
