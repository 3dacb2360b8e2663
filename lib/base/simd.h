#pragma once

// Loops over arrays that take several numbers at a time. SEXTANT_SIMD before a function makes two clones of
// it, for processors with AVX2 and for all, of which the program takes one when it starts; SEXTANT_X86 guards
// what is written in intrinsics of SSE2, which every such processor has. Either way the bits are the same:
// loops use only operations that IEEE 754 defines exactly, and none are fused (-ffp-contract=off,
// cmake/SextantOptions.cmake). The thread sanitizer cannot run the function that chooses among clones.

#if defined(__x86_64__)
#define SEXTANT_X86 1
#else
#define SEXTANT_X86 0
#endif

#if SEXTANT_X86 && !defined(__SANITIZE_THREAD__)
#define SEXTANT_SIMD __attribute__((target_clones("avx2", "default")))
#else
#define SEXTANT_SIMD
#endif

/// For what such loops call: a call would keep them from being vectorised.
#define SEXTANT_INLINED [[gnu::always_inline]] inline
