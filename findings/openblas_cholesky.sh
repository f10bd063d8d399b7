#!/usr/bin/env bash
# Versions:  libopenblas0-serial 0.3.21+ds-4, liblapack3 3.11.0-2, libblas3 3.11.0-2 (Debian 12, amd64)
# Guess:     dpotrf reports a matrix that is not positive definite, in OpenBLAS as in LAPACK (info > 0): each pivot is tested. So
#            a solver that asks CHOLMOD whether the factor exists needs no test of its own.
# Behaviour: LAPACK refuses a pivot that is <= 0 or NaN, OpenBLAS' own dpotrf only one that is <= 0. A finite matrix, not positive
#            definite, whose pivot becomes inf - inf = NaN, is factorised "with success", and the factor has NaN. The same holds
#            for CHOLMOD's supernodal factor, which asks dpotrf: with OpenBLAS it says CHOLMOD_OK.
# Seen:      LAPACK: info 4, OpenBLAS: info 0, and NaN in the factor
. "$(dirname "$0")/fetch"
fetch libopenblas0-serial=0.3.21+ds-4 liblapack3=3.11.0-2 libblas3=3.11.0-2 libgfortran5=12.2.0-14+deb12u1 libquadmath0=12.2.0-14+deb12u1

info_of_dpotrf() {
  LD_LIBRARY_PATH=$1 python3 - <<'PYTHON'
import ctypes

lapack = ctypes.CDLL("liblapack.so.3")
rows = [[1e-300, 0, 1, 1e10], [0, 1e-300, 1, -1e10], [1, 1, 1e301, 0], [1e10, -1e10, 0, 1]]
A = (ctypes.c_double * 16)(*(value for row in rows for value in row))
n, info = ctypes.c_int(4), ctypes.c_int(-1)
lapack.dpotrf_(b"L", ctypes.byref(n), A, ctypes.byref(n), ctypes.byref(info))
print(f"info {info.value}" + (", the last pivot is NaN" if info.value == 0 and A[15] != A[15] else ""))
PYTHON
}
expect "LAPACK" "$(info_of_dpotrf "$libraries/lapack:$libraries/blas:$libraries")" "info 4"
expect "OpenBLAS" "$(info_of_dpotrf "$libraries/openblas-serial:$libraries")" "info 0, the last pivot is NaN"
