#pragma once

// SEXTANT_SIMD before a function: it is compiled for AVX2 as well, and the processor decides which of the two
// runs. The thread sanitizer cannot run the function that chooses, which is called before the program begins.

#if defined(__x86_64__) && !defined(__SANITIZE_THREAD__)
#define SEXTANT_SIMD __attribute__((target_clones("avx2", "default")))
#else
#define SEXTANT_SIMD
#endif
