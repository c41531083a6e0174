# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""ROS parameters from the list in ``settings``, and what is done when one is set."""

from __future__ import annotations

import warnings
from collections.abc import Callable

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from vigg_ros.node.settings import RESERVED, Parameter, Settings
from vigg_ros.registration.errors import ConfigError


class NodeParameters:
    """The node's parameters. The node must have been made with its overrides declared: they are checked here,
    where an integer may stand for a real number, and declared anew as what they are. Raises ConfigError.
    """

    def __init__(self, node: Node, changed: Callable[[Settings], None]) -> None:
        overrides = node.get_parameters_by_prefix("")
        given = {name: _plain(one.value) for name, one in overrides.items() if not name.startswith(RESERVED)}
        with warnings.catch_warnings(record=True) as notes:
            warnings.simplefilter("always", FutureWarning)
            self.settings = Settings.resolve(given)
        for note in notes:
            node.get_logger().warning(str(note.message))
        self._changed = changed
        for name in given:
            node.undeclare_parameter(name)
        for parameter in self.settings.parameters():
            node.declare_parameter(parameter.name, parameter.default, _descriptor(parameter), ignore_override=True)
        self._types = {parameter.name: type(parameter.default) for parameter in self.settings.parameters()}
        node.add_pre_set_parameters_callback(self._coerce)
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._apply)

    def _coerce(self, parameters: list[RosParameter]) -> list[RosParameter]:
        """An integer for a real number is accepted at run time too."""
        return [
            RosParameter(one.name, value=float(one.value))
            if self._types.get(one.name) is float and one.type_ == RosParameter.Type.INTEGER
            else one
            for one in parameters
        ]

    def _check(self, parameters: list[RosParameter]) -> SetParametersResult:
        try:
            self.settings.replace(_values(parameters))
        except ConfigError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply(self, parameters: list[RosParameter]) -> None:
        self.settings = self.settings.replace(_values(parameters))
        self._changed(self.settings)


def _values(parameters: list[RosParameter]) -> dict[str, object]:
    return {one.name: one.value for one in parameters if not one.name.startswith(RESERVED)}


def _plain(value: object) -> object:
    """Arrays as lists."""
    return value if isinstance(value, (bool, int, float, str)) or not hasattr(value, "__iter__") else list(value)


def _descriptor(parameter: Parameter) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(description=parameter.description, read_only=not parameter.is_dynamic)
    if parameter.choices:
        descriptor.additional_constraints = f"one of {', '.join(parameter.choices)}"
    if parameter.low is not None and parameter.high is not None:
        if isinstance(parameter.default, float):
            limits = FloatingPointRange(from_value=float(parameter.low), to_value=float(parameter.high), step=0.0)
            descriptor.floating_point_range = [limits]
        else:
            limits = IntegerRange(from_value=int(parameter.low), to_value=int(parameter.high), step=0)
            descriptor.integer_range = [limits]
    return descriptor
