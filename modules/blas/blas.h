#pragma once

// The BLAS that CHOLMOD computes with. Debian's programs load whichever library the alternative
// libblas.so.3 names; libraries differ in time by more than a factor of two, and in the last bits.

#include <string>

namespace pangea {

struct Blas {
  std::string name = {};  // "OpenBLAS 0.3.21, kernel Zen"
  std::string file = {};  // without symbolic links; empty if there is no BLAS
  bool is_slow = false;   // ATLAS, or the reference BLAS
};

// The BLAS of this process; of a program that links none, the one that others would load.
Blas LoadedBlas();

// "BLAS: OpenBLAS 0.3.21, kernel Zen (/usr/lib/.../libblas.so.3)"; of a slow one also what to do.
std::string ToString(const Blas& blas);

// Makes OpenBLAS and OpenMP compute everything in the calling thread. OpenBLAS gives other bits
// with more threads. CHOLMOD would start three more even with OMP_NUM_THREADS=1, because it asks
// OpenMP for four. Call this on each thread that uses CHOLMOD, before that.
void UseOneThread();

}  // namespace pangea
