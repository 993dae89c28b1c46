"""The bodies of the graph's tasks: plain functions on Arrow tables, one module a stage.

Each module has a `VERSION` that rises with its algorithm, so that results of an older one are not taken for
new.
"""
