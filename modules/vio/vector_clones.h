#pragma once

// A function marked so is compiled twice, for any processor and for those with AVX2; the first call
// chooses. Both give the same bytes: the compiler neither contracts a product and a sum
// (-ffp-contract=off) nor changes the order of a sum. What it calls must be inline to gain. Not
// under sanitizers, which are not ready yet when the loader asks, nor with other compilers.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define PANGEA_VECTOR_CLONES [[gnu::target_clones("arch=x86-64-v3", "default")]]
#else
#define PANGEA_VECTOR_CLONES
#endif
