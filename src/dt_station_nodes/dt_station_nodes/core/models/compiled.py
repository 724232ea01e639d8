"""The one calling convention of compiled effects, and how the kernel calls them by address.

An effect is a C function `step(parameters, state, value, context) -> value`. Calling it by address lets one
cached kernel run every combination of effects, foreign ones included, without compiling anything again.
"""

from collections.abc import Callable, MutableSequence
from typing import Any

import numba
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

Doubles = MutableSequence[float]
_POINTER = types.CPointer(types.float64)
SIGNATURE = types.float64(_POINTER, _POINTER, types.float64, _POINTER)

# Places in the context that the kernel fills for each effect (and, for INJECTION, reads back).
TIME = 0  # s, start of the sub-step
SUBSTEP = 1  # s, its length
RAW_INPUT = 2  # V, the path's voltage before any effect
OUTPUT = 3  # Pa or m above rest, before output effects, at the start of the sub-step
FREE_VELOCITY = 4  # Pa/s or m/s at the end of the sub-step if the effect did nothing, without a cylinder's INJECTION
VELOCITY_GAIN = 5  # change of that velocity per volt
FREE_OUTPUT = 6  # Pa or m above rest at the end of the sub-step if the effect did nothing
INJECTION_GAIN = 7  # change of that output per unit of injection
LOAD = 8  # Pa above rest, pressure that loads the path (on the pressure path its own), half-way through the sub-step
INJECTION = 9  # Pa/s or m/s, flow into the store behind the output; effects add to it
REST = 10  # Pa, rest pressure, so that LOAD + REST is absolute (on both paths)
LOAD_VELOCITY = 11  # Pa/s or m/s, the part of FREE_VELOCITY that the disturbance path makes
STAGE = 12  # where the effect is called: 0 input, 1 state, 2 output
OUTLET_RATE = 13  # 1/s, decay of what is injected (0 for a cylinder)
OUTPUT_REST = 14  # Pa or m, the path's own rest, so that OUTPUT + OUTPUT_REST is absolute
INLET_RATE = 15  # 1/s, decay of the one store before the output's, 0 where there is none
STATIC_GAIN = 16  # Pa/V or m/V, 0 for an integrating path
VELOCITY = 17  # Pa/s or m/s at the start of the sub-step, without voltage feed-through and injection
OTHER_INPUT = 18  # V, the other path's voltage
SETTLING_RATE = 19  # 1/s, of a static path: one over its mean lag; 0 for an integrating one
SPEED_GAIN = 20  # m/s or Pa/s per volt in steady motion of an integrating path; 0 for a static one
OUTPUT_GAIN = 21  # change of FREE_OUTPUT per volt
LOAD_OUTPUT = 22  # Pa or m, the part of FREE_OUTPUT that the disturbance path makes
OWN_LOAD = 23  # 1: the path's output is the load, as far as it is foretold at the place of the effect
CONTEXT_SIZE = 24


def effect_step(function: Callable[..., float]) -> Any:
    """Compile an effect's step to a cached C function of the one signature.

    It has nobody to raise to: dividing by zero gives infinity or not-a-number, as in C.
    """
    return numba.cfunc(SIGNATURE, cache=True, error_model="numpy")(function)


@intrinsic
def call_step(typing_context: Any, address: Any, parameters: Any, state: Any, value: Any, context: Any) -> Any:
    """Call the effect at an address; pointers are passed as integers (`array.ctypes.data`)."""
    signature = types.float64(types.int64, types.int64, types.int64, types.float64, types.int64)

    def codegen(_target: Any, builder: Any, _signature: Any, args: Any) -> Any:
        double = ir.DoubleType()
        pointer = double.as_pointer()
        function_type = ir.FunctionType(double, [pointer, pointer, double, pointer])
        function = builder.inttoptr(args[0], function_type.as_pointer())
        call = [builder.inttoptr(args[1], pointer), builder.inttoptr(args[2], pointer), args[3]]
        return builder.call(function, [*call, builder.inttoptr(args[4], pointer)])

    return signature, codegen


@intrinsic
def doubles(typing_context: Any, address: Any) -> Any:
    """Floats at an address: plain pointer, no bounds, no reference count."""
    return _POINTER(types.int64), _to_pointer


@intrinsic
def integers(typing_context: Any, address: Any) -> Any:
    """64-bit integers at an address."""
    return types.CPointer(types.int64)(types.int64), _to_pointer


def _to_pointer(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    return builder.inttoptr(args[0], context.get_value_type(signature.return_type))


@numba.njit(cache=True, _nrt=False, forceinline=True)
def halfway(context: Doubles) -> float:
    """Output (Pa or m above rest) half-way through the sub-step if the effect did nothing.

    What is fed back from there is neither early nor late, so that errors fall with the square of the sub-step.
    """
    return 0.5 * (context[OUTPUT] + context[FREE_OUTPUT])
