#!/usr/bin/env bash
# Versions:  libopenblas0-serial 0.3.21+ds-4, libblas3 3.11.0-2 (Debian 12, amd64)
# Guess:     A'A by dgemm is symmetric bit by bit: (i, j) and (j, i) are sums of the same products in the same order. So one may
#            take either triangle of a normal equations' matrix J'J.
# Behaviour: OpenBLAS computes the rows and columns that do not fill a block of its kernel with another kernel, whose sums have
#            another order. Where the two triangles meet different kernels, they differ in the last bits: 101 x 101, of 300 rows.
#            The reference BLAS is symmetric. With another kernel of the same library the result may be symmetric, too: it depends
#            on the processor (OPENBLAS_CORETYPE fixes it here).
# Seen:      reference BLAS: 0 of 5050 pairs differ; OpenBLAS, kernel Nehalem: 82
. "$(dirname "$0")/fetch"
fetch libopenblas0-serial=0.3.21+ds-4 libblas3=3.11.0-2 libgfortran5=12.2.0-14+deb12u1 libquadmath0=12.2.0-14+deb12u1

pairs_that_differ() {
  OPENBLAS_CORETYPE=Nehalem LD_LIBRARY_PATH=$libraries/$1:$libraries python3 - <<'PYTHON'
import ctypes
import random

blas = ctypes.CDLL("libblas.so.3")
n, k = 101, 300
rng = random.Random(1)
A = (ctypes.c_double * (n * k))(*(rng.uniform(-0.5, 0.5) for _ in range(n * k)))
C = (ctypes.c_double * (n * n))()
rows, size, one, zero = ctypes.c_int(k), ctypes.c_int(n), ctypes.c_double(1), ctypes.c_double(0)
by = ctypes.byref
blas.dgemm_(b"T", b"N", by(size), by(size), by(rows), by(one), A, by(rows), A, by(rows), by(zero), C, by(size))
print(sum(C[i + j * n] != C[j + i * n] for i in range(n) for j in range(i)))
PYTHON
}
expect "reference BLAS, pairs (i, j), (j, i) that differ" "$(pairs_that_differ blas)" 0
expect "OpenBLAS" "$(pairs_that_differ openblas-serial)" 82
