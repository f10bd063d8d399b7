#pragma once

// Authenticated encryption of link packets: XChaCha20-Poly1305 (libsodium), key derivation by keyed
// BLAKE2b, and a replay window that accepts each numbered packet once.
// docs/decisions/link_security.md says what is sealed under which key, and why.

#include <array>
#include <bitset>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "core/bytes.h"

namespace pangea {

// 32 secret bytes; each copy is wiped from memory when it is destroyed.
class SecretKey {
 public:
  static constexpr size_t kBytes = 32;

  static SecretKey Random();
  explicit SecretKey(const std::array<uint8_t, kBytes>& bytes);
  SecretKey(const SecretKey&) = default;
  SecretKey& operator=(const SecretKey&) = default;
  ~SecretKey();

  const std::array<uint8_t, kBytes>& bytes() const { return bytes_; }
  bool operator==(const SecretKey& other) const;
  // Derives a key for one purpose, agent and session. It reveals nothing about this key or about
  // other derived keys.
  SecretKey Derive(std::string_view purpose, int32_t agent_id, uint64_t uplink_run = 0,
                   uint64_t handler_run = 0) const;

 private:
  std::array<uint8_t, kBytes> bytes_{};
};

uint64_t RandomNumber();

inline constexpr int kSealTagBytes = 16;
inline constexpr int kSealNonceBytes = 24;

using SealNonce = std::array<uint8_t, kSealNonceBytes>;

SealNonce RandomNonce();

// Returns `clear` as it is, then `body` encrypted, then a tag that authenticates both. A nonce must
// never be used twice with one key.
std::vector<uint8_t> Seal(const SecretKey& key, const SealNonce& nonce, Bytes clear, Bytes body);
// Decrypts the body of a packet whose first `clear_bytes` are not encrypted. Nothing if any bit was
// changed, or key or nonce are wrong.
std::optional<std::vector<uint8_t>> OpenSealed(const SecretKey& key, const SealNonce& nonce,
                                               Bytes packet, size_t clear_bytes);

// Which packet numbers of a stream were already received. A packet has only the low 24 bits of its
// number; the window knows the rest, because it follows the highest number received.
class ReplayWindow {
 public:
  // A packet that so many others have overtaken counts as too old: about one second at 4 MB/s.
  static constexpr int64_t kSize = 4096;

  explicit ReplayWindow(int64_t highest = 0) : highest_(highest) {}

  // The full number with these low bits that is nearest to the next expected number.
  int64_t Expand(uint32_t low_24_bits) const;
  // Whether the number was not received yet and is not too old.
  bool IsFresh(int64_t number) const;
  void Take(int64_t number);

 private:
  int64_t highest_;
  std::bitset<kSize> taken_;
};

}  // namespace pangea
