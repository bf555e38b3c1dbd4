// SPDX-License-Identifier: Apache-2.0
// Run-time dispatch for hot loops that the compiler vectorises: the same source, compiled for AVX-512 (for
// its 32 registers), AVX2 and the baseline, chosen when the program is loaded. None contracts multiplications
// and additions, so all give the same bits.
#pragma once

/// For helpers of a dispatched function: a helper that is not inlined is compiled for the baseline only.
#define WARMFRONT_INLINE [[gnu::always_inline]] inline

/// WARMFRONT_LONG_PRODUCT_CLONES: for loops of products of 64-bit integers, of which AVX-512 alone makes
/// several at a time; what AVX2 needs for one takes longer than the baseline's.
#if defined(WARMFRONT_ONE_TARGET)  // tests/clones
#define WARMFRONT_LONG_PRODUCT_CLONES
#define WARMFRONT_TARGET_CLONES [[gnu::target(WARMFRONT_ONE_TARGET)]]
#elif defined(__x86_64__) && defined(__GNUC__) && __GNUC__ >= 12 && !defined(__clang__) && \
    !defined(WARMFRONT_NO_TARGET_CLONES)
#define WARMFRONT_TARGET_CLONES [[gnu::target_clones("arch=x86-64-v4", "avx2", "default")]]
#define WARMFRONT_LONG_PRODUCT_CLONES [[gnu::target_clones("arch=x86-64-v4", "default")]]
#else
#define WARMFRONT_TARGET_CLONES
#define WARMFRONT_LONG_PRODUCT_CLONES
#if !defined(__AVX2__)
/// There is nothing but registers of 16 bytes: vectors are halved (halves.h).
#define WARMFRONT_REGISTERS_OF_16_BYTES
#endif
#endif
