#pragma once

// A function with this mark is compiled twice: for any x86-64 processor and for those with AVX2;
// the first call selects one. Both give the same bytes: the compiler neither contracts a product
// and a sum (-ffp-contract=off) nor reorders a sum. Functions that it calls gain only if they are
// inlined. Disabled under sanitizers, which are not initialised yet when the loader selects, and
// with other compilers.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define PANGEA_VECTOR_CLONES [[gnu::target_clones("arch=x86-64-v3", "default")]]
#else
#define PANGEA_VECTOR_CLONES
#endif
