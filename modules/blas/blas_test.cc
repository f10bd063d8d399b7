#include "blas/blas.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pangea {
namespace {

using testing::HasSubstr;

// tests/blas_test.cc runs programs with each BLAS that this machine has.
TEST(Blas, IsFoundByAProgramThatLinksNone) {
  const Blas blas = LoadedBlas();
  EXPECT_NE(blas.name, "none");
  EXPECT_THAT(blas.file, HasSubstr("blas"));
}

TEST(Blas, ThatIsSlowComesWithWhatToDo) {
  const std::string fast =
      ToString({.name = "OpenBLAS 0.3.21, kernel Zen", .file = "/usr/lib/abc/x/libblas.so.3"});
  EXPECT_EQ(fast, "BLAS: OpenBLAS 0.3.21, kernel Zen (/usr/lib/abc/x/libblas.so.3)");
  const std::string slow =
      ToString({.name = "ATLAS", .file = "/usr/lib/abc/atlas/libblas.so.3", .is_slow = true});
  EXPECT_THAT(slow, HasSubstr("apt install libopenblas0-serial"));
  EXPECT_THAT(slow, HasSubstr("update-alternatives --auto libblas.so.3-"));
  EXPECT_EQ(ToString({.name = "none"}), "BLAS: none");
}

// Neither OpenBLAS nor OpenMP may be there.
TEST(Blas, OneThreadNeedsNoLibrary) { UseOneThread(); }

}  // namespace
}  // namespace pangea
