#!/usr/bin/env bash
# Versions:  libceres3 2.1.0+really2.1.0+dfsg-1, libatlas3-base 3.10.3-13, libopenblas0-serial 0.3.21+ds-4 (Debian 12, amd64)
# Guess:     CHOLMOD needs libblas.so.3 and nothing else, so it computes with the library that this name leads to: with OpenBLAS as
#            the machine's libblas.so.3, also in a program that links Ceres.
# Behaviour: libceres.so.3 itself needs libf77blas.so.3, which is ATLAS and no alternative. The loader looks for dgemm_ breadth
#            first: libf77blas.so.3, needed by Ceres, comes before the libblas.so.3 that CHOLMOD needs. So CHOLMOD computes with
#            ATLAS in each program that links Ceres, and with OpenBLAS in one that links CHOLMOD alone. Nothing says so:
#            `ldd` lists both, and update-alternatives shows OpenBLAS.
# Seen:      CHOLMOD alone: libblas.so.3; CHOLMOD with Ceres: libf77blas.so.3
. "$(dirname "$0")/fetch"
fetch libceres3=2.1.0+really2.1.0+dfsg-1 libatlas3-base=3.10.3-13 libopenblas0-serial=0.3.21+ds-4 libcholmod3=1:5.12.0+dfsg-2 \
  libspqr2=1:5.12.0+dfsg-2 libcxsparse3=1:5.12.0+dfsg-2 libamd2=1:5.12.0+dfsg-2 libcamd2=1:5.12.0+dfsg-2 libcolamd2=1:5.12.0+dfsg-2 \
  libccolamd2=1:5.12.0+dfsg-2 libsuitesparseconfig5=1:5.12.0+dfsg-2 libmetis5=5.1.0.dfsg-7 libunwind8=1.6.2-3 \
  libgoogle-glog0v6=0.6.0-2 libgflags2.2=2.2.2-2 libgomp1=12.2.0-14+deb12u1 libgfortran5=12.2.0-14+deb12u1 \
  libquadmath0=12.2.0-14+deb12u1

# The library whose dgemm_ CHOLMOD gets, in a program that links these libraries; OpenBLAS is what libblas.so.3 leads to.
dgemm_of_cholmod() {
  LD_LIBRARY_PATH=$libraries/openblas-serial:$libraries LD_PRELOAD=$1 LD_BIND_NOW=1 LD_DEBUG=bindings /bin/true 2>&1 |
    sed -n "s/.*libcholmod.so.3 .* to [^ ]*\/\([^ ]*\) .*symbol .dgemm_'.*/\1/p"
}
expect "CHOLMOD alone" "$(dgemm_of_cholmod libcholmod.so.3)" libblas.so.3
expect "CHOLMOD with Ceres" "$(dgemm_of_cholmod libceres.so.3)" libf77blas.so.3
