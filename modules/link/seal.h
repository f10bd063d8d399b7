#pragma once

// Authenticated encryption of link packets: XChaCha20-Poly1305 (libsodium), keys derived by keyed
// BLAKE2b, and the window that lets each numbered packet in once. What is sealed under which key,
// and why: docs/decisions/link_security.md.

#include <array>
#include <bitset>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "bus/bus.h"

namespace pangea {

// 32 secret bytes; each copy is wiped when it goes.
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
  // A key for one purpose, agent and session; tells nothing of this one or of its other children.
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

// `clear`, then `body` encrypted, then a tag over both. A nonce must never be used twice with one
// key.
std::vector<uint8_t> Seal(const SecretKey& key, const SealNonce& nonce, Bytes clear, Bytes body);
// The body of what follows the first `clear_bytes` of a packet; nothing unless every bit is as
// sealed.
std::optional<std::vector<uint8_t>> OpenSealed(const SecretKey& key, const SealNonce& nonce,
                                               Bytes packet, size_t clear_bytes);

// Which numbers of a stream have been taken. Only the low 24 bits of a number travel; the window
// knows the rest, because it moves with the highest one taken.
class ReplayWindow {
 public:
  // As many packets may overtake one before it counts as too old: a second of 4 MB/s.
  static constexpr int64_t kSize = 4096;

  explicit ReplayWindow(int64_t highest = 0) : highest_(highest) {}

  // The number with these low bits that is nearest to the next one.
  int64_t Expand(uint32_t low_24_bits) const;
  // Neither taken already nor too old to tell.
  bool IsFresh(int64_t number) const;
  void Take(int64_t number);

 private:
  int64_t highest_;
  std::bitset<kSize> taken_;
};

}  // namespace pangea
