#pragma once

// Vectorised loops over arrays. SEXTANT_SIMD before a function makes two clones of it, one for processors
// with AVX2 and one for all others; the program selects one at start-up. SEXTANT_X86 guards code in SSE2
// intrinsics, which every x86-64 processor has. Results have the same bits on either path: loops use only
// operations that IEEE 754 defines exactly, and none are fused (-ffp-contract=off,
// cmake/SextantOptions.cmake). Builds with the thread sanitizer have no clones, because the sanitizer cannot
// run the function that selects one.

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

/// Marks functions that are called inside vectorised loops: a call that is not inlined would prevent
/// vectorisation.
#define SEXTANT_INLINED [[gnu::always_inline]] inline
