#include "blas/blas.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <filesystem>

namespace pangea {
namespace {

constexpr char kAnyRoutine[] = "dgemm_";  // every BLAS has it

template <typename Function>
Function* Find(void* library, const char* name) {
  return reinterpret_cast<Function*>(dlsym(library, name));
}

// The routine of this process, or else of the library that others would load. Null: there is none.
void* Routine() {
  if (void* const routine = dlsym(RTLD_DEFAULT, kAnyRoutine)) {
    return routine;
  }
  void* const library = dlopen("libblas.so.3", RTLD_LAZY | RTLD_LOCAL);
  return library == nullptr ? nullptr : dlsym(library, kAnyRoutine);
}

// The version is the second word of "OpenBLAS 0.3.21 NO_LAPACKE DYNAMIC_ARCH ...".
std::string OpenBlasName(const std::string& config, const char* kernel) {
  const size_t end = config.find(' ', config.find(' ') + 1);
  return fmt::format("{}, kernel {}", config.substr(0, end), kernel);
}

}  // namespace

Blas LoadedBlas() {
  Dl_info place{};
  if (void* const routine = Routine(); routine == nullptr || dladdr(routine, &place) == 0) {
    return {.name = "none"};
  }
  std::error_code ignored;
  const std::filesystem::path file = std::filesystem::canonical(place.dli_fname, ignored);
  Blas blas{.name = "unknown", .file = file.empty() ? place.dli_fname : file.string()};
  // Its functions, and those of the libraries that it needs: Debian's libblas.so.3 of OpenBLAS
  // only has the routines, and libopenblas.so.0 all else.
  void* const library = dlopen(place.dli_fname, RTLD_LAZY | RTLD_NOLOAD);
  auto* const config = Find<const char*()>(library, "openblas_get_config");
  auto* const kernel = Find<const char*()>(library, "openblas_get_corename");
  if (config != nullptr && kernel != nullptr) {
    blas.name = OpenBlasName(config(), kernel());
  } else if (dlsym(library, "atl_f77wrap_dgemm_") != nullptr) {
    blas.name = "ATLAS";
    blas.is_slow = true;
  } else if (file.parent_path().filename() == "blas") {  // Debian's libblas3
    blas.name = "reference BLAS";
    blas.is_slow = true;
  }
  return blas;
}

std::string ToString(const Blas& blas) {
  std::string text = "BLAS: " + blas.name;
  if (!blas.file.empty()) {
    text += fmt::format(" ({})", blas.file);
  }
  if (blas.is_slow) {
    text +=
        ". WARNING: it takes up to twice the CPU time of OpenBLAS: apt install "
        "libopenblas0-serial; if that is installed: "
        "update-alternatives --auto libblas.so.3-" PANGEA_ARCHITECTURE;
  }
  return text;
}

void UseOneThread() {
  // Looked up by name: this machine may have another BLAS, and only CHOLMOD links OpenMP. Without
  // any active level of parallel regions, each region runs in one thread.
  static auto* const set_levels = Find<void(int)>(RTLD_DEFAULT, "omp_set_max_active_levels");
  static auto* const set_threads = Find<void(int)>(RTLD_DEFAULT, "openblas_set_num_threads");
  if (set_levels != nullptr) {
    set_levels(0);
  }
  if (set_threads != nullptr) {
    set_threads(1);
  }
}

}  // namespace pangea
