#include "link/seal.h"

#include <gtest/gtest.h>

#include <numeric>

namespace pangea {
namespace {

const std::vector<uint8_t> kClear = {1, 2, 3, 4};
const std::vector<uint8_t> kBody = {9, 8, 7, 6, 5, 4, 3, 2, 1};

std::array<uint8_t, 32> Counting(uint8_t first) {
  std::array<uint8_t, 32> bytes;
  std::iota(bytes.begin(), bytes.end(), first);
  return bytes;
}

// The test vector of draft-irtf-cfrg-xchacha-03, A.3.1.
TEST(Seal, IsXChaCha20Poly1305) {
  const std::string text =
      "Ladies and Gentlemen of the class of '99: If I could offer you only one tip for the future, "
      "sunscreen would be it.";
  const std::vector<uint8_t> clear = {0x50, 0x51, 0x52, 0x53, 0xc0, 0xc1,
                                      0xc2, 0xc3, 0xc4, 0xc5, 0xc6, 0xc7};
  SealNonce nonce;
  std::iota(nonce.begin(), nonce.end(), 0x40);
  const auto packet = Seal(SecretKey(Counting(0x80)), nonce, clear,
                           {reinterpret_cast<const uint8_t*>(text.data()), text.size()});
  const std::vector<uint8_t> tag = {0xc0, 0x87, 0x59, 0x24, 0xc1, 0xc7, 0x98, 0x79,
                                    0x47, 0xde, 0xaf, 0xd8, 0x78, 0x0a, 0xcf, 0x49};
  EXPECT_EQ(packet[clear.size()], 0xbd);
  EXPECT_TRUE(std::equal(tag.begin(), tag.end(), packet.end() - kSealTagBytes));
}

TEST(Seal, OpensOnlyWhatIsAsSealed) {
  const SecretKey key = SecretKey::Random();
  const SealNonce nonce = RandomNonce();
  const auto packet = Seal(key, nonce, kClear, kBody);
  EXPECT_EQ(packet.size(), kClear.size() + kBody.size() + kSealTagBytes);
  EXPECT_EQ(OpenSealed(key, nonce, packet, kClear.size()), kBody);
  for (size_t i = 0; i < packet.size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      auto flipped = packet;
      flipped[i] ^= static_cast<uint8_t>(1 << bit);
      EXPECT_FALSE(OpenSealed(key, nonce, flipped, kClear.size())) << i;
    }
  }
  for (size_t size = 0; size < packet.size(); ++size) {
    EXPECT_FALSE(OpenSealed(key, nonce, Bytes(packet).first(size), kClear.size()));
  }
  EXPECT_FALSE(OpenSealed(SecretKey::Random(), nonce, packet, kClear.size()));
  EXPECT_FALSE(OpenSealed(key, RandomNonce(), packet, kClear.size()));
}

TEST(SecretKey, DerivedKeysDifferInEveryPart) {
  const SecretKey key(Counting(1));
  const std::vector<SecretKey> keys = {key.Derive("up", 1),
                                       key.Derive("down", 1),
                                       key.Derive("up", 2),
                                       key.Derive("up", 1, 5),
                                       key.Derive("up", 1, 0, 5),
                                       SecretKey(Counting(2)).Derive("up", 1),
                                       key};
  for (size_t i = 0; i < keys.size(); ++i) {
    for (size_t j = 0; j < keys.size(); ++j) {
      EXPECT_EQ(keys[i] == keys[j], i == j) << i << " " << j;
    }
  }
  EXPECT_TRUE(key.Derive("up", 1, 2, 3) == key.Derive("up", 1, 2, 3));
}

TEST(ReplayWindow, TakesEachNumberOnceInAnyOrder) {
  ReplayWindow window;
  EXPECT_FALSE(window.IsFresh(0));
  for (const int64_t number : {5, 3, 4, 1, 9000, 8999, 4905}) {
    EXPECT_TRUE(window.IsFresh(number)) << number;
    window.Take(number);
    EXPECT_FALSE(window.IsFresh(number)) << number;
  }
  EXPECT_FALSE(window.IsFresh(9000 - ReplayWindow::kSize)) << "too old to tell";
  EXPECT_TRUE(window.IsFresh(9000 - ReplayWindow::kSize + 2));
  window.Take(9000 + ReplayWindow::kSize - 1);
  EXPECT_FALSE(window.IsFresh(9000));
  EXPECT_TRUE(window.IsFresh(9001));
}

TEST(ReplayWindow, TheOldestItCanTellIsAWindowBack) {
  ReplayWindow window;
  const int64_t highest = 9000;
  window.Take(highest);
  const int64_t oldest = highest - ReplayWindow::kSize + 1;
  // Their places in the window are free, so that only their age makes them invalid.
  for (int64_t number = oldest - ReplayWindow::kSize; number < oldest; ++number) {
    ASSERT_FALSE(window.IsFresh(number)) << number;
  }
  EXPECT_TRUE(window.IsFresh(oldest));
}

TEST(ReplayWindow, AJumpForgetsWhatLiesBeforeTheWindowAlone) {
  ReplayWindow window;
  for (int64_t number = 1; number <= ReplayWindow::kSize; ++number) {
    window.Take(number);
  }
  const int64_t far = 10 * ReplayWindow::kSize + 3;
  window.Take(far);
  EXPECT_FALSE(window.IsFresh(far));
  for (int64_t number = far - ReplayWindow::kSize + 1; number < far; ++number) {
    ASSERT_TRUE(window.IsFresh(number)) << number;
  }
}

TEST(ReplayWindow, KnowsTheHighBitsOfANumber) {
  constexpr int64_t kRange = 1 << 24;
  for (const int64_t highest : {int64_t{0}, int64_t{77}, kRange - 1, 5 * kRange + 12}) {
    const ReplayWindow window(highest);
    for (const int64_t ahead : {int64_t{1}, int64_t{1000}, kRange / 2}) {
      const int64_t number = highest + ahead;
      EXPECT_EQ(window.Expand(static_cast<uint32_t>(number) & 0xFFFFFF), number) << highest;
    }
    for (const int64_t behind : {int64_t{0}, int64_t{4000}}) {
      if (highest >= behind) {
        EXPECT_EQ(window.Expand(static_cast<uint32_t>(highest - behind) & 0xFFFFFF),
                  highest - behind);
      }
    }
  }
}

}  // namespace
}  // namespace pangea
