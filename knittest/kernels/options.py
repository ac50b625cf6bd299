"""Compiler options shared by all kernels.

``nnan`` and ``ninf`` stay out of the fast-math flags so that NaN and Inf remain detectable; ``reassoc`` and ``arcp``
because LLVM rearranges a function anew in every kernel it is linked into, so that one thread and several, or code just
compiled and code read back, would differ in their last bits. Loop indices in blocked loops are unsigned (:data:`U`): a
signed ``start + k`` keeps LLVM from vectorising, and so does a sum of floats, which has an order.
"""

from typing import Any

import numpy as np

from knittest.kernels import CODE_FOLDER

FASTMATH = {"contract", "nsz"}
U = np.uintp
ONE = np.uintp(1)

#: a kernel that makes arrays: each array that it reads is counted, atomically, also in its loops
ALLOCATING: dict[str, Any] = {
    "cache": CODE_FOLDER is not None, "error_model": "numpy", "fastmath": FASTMATH, "nogil": True,
}  # fmt: skip
#: a kernel called from Python or from another kernel; it counts no references, so that it may neither make nor return
#: an array
KERNEL: dict[str, Any] = {**ALLOCATING, "_nrt": False}
#: a kernel that only kernels call: without the wrappers by which Python would call it, a quarter of all compilation;
#: Python that called it nevertheless would end without a word
PART: dict[str, Any] = {**KERNEL, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
#: a pure function of scalars, inlined into the blocked loops by LLVM
INLINE: dict[str, Any] = {**PART, "forceinline": True}
#: a sum of floats in any order, of what decides no result
ANY_ORDER: dict[str, Any] = {**INLINE, "fastmath": FASTMATH | {"reassoc"}}
#: parts of an array, taken apart where they are used: inlined before it is decided whether references are counted
ROWS: dict[str, Any] = {"cache": CODE_FOLDER is not None, "inline": "always"}
#: a kernel with prange; only prange loops are made parallel, which spares compile time
PARALLEL: dict[str, Any] = {
    "cache": CODE_FOLDER is not None,
    "error_model": "numpy",
    "fastmath": FASTMATH,
    "parallel": {
        "comprehension": False,
        "fusion": False,
        "inplace_binop": False,
        "numpy": False,
        "prange": True,
        "reduction": False,
        "setitem": False,
        "stencil": False,
    },
}

#: partitions of the nodes; fixed, so that sums have the same order at any thread count
PARTITIONS = 16
_BITS = (PARTITIONS - 1).bit_length()
#: the order in which they are shared out, bits reversed: a thread takes a run of it and so gets partitions from all
#: over the fabric, whose expensive and cheap regions (some of the contacts, what the tools touch) are shared evenly
SHARED_OUT = np.array([int(f"{p:0{_BITS}b}"[::-1], 2) for p in range(PARTITIONS)])
