#include "link/seal.h"

#include <fmt/format.h>
#include <sodium.h>

#include <algorithm>
#include <stdexcept>

#include "link/bytes_io.h"

namespace pangea {
namespace {

static_assert(kSealTagBytes == crypto_aead_xchacha20poly1305_ietf_ABYTES);
static_assert(kSealNonceBytes == crypto_aead_xchacha20poly1305_ietf_NPUBBYTES);
static_assert(SecretKey::kBytes == crypto_aead_xchacha20poly1305_ietf_KEYBYTES);

void StartSodium() {
  static const int started = sodium_init();
  if (started < 0) {
    throw std::runtime_error("libsodium does not start: the system gives no random numbers");
  }
}

}  // namespace

SecretKey::SecretKey(const std::array<uint8_t, kBytes>& bytes) : bytes_(bytes) { StartSodium(); }

SecretKey::~SecretKey() { sodium_memzero(bytes_.data(), bytes_.size()); }

SecretKey SecretKey::Random() {
  StartSodium();
  SecretKey key({});
  randombytes_buf(key.bytes_.data(), key.bytes_.size());
  return key;
}

bool SecretKey::operator==(const SecretKey& other) const {
  return sodium_memcmp(bytes_.data(), other.bytes_.data(), kBytes) == 0;
}

SecretKey SecretKey::Derive(std::string_view purpose, int32_t agent_id, uint64_t uplink_run,
                            uint64_t handler_run) const {
  WireWriter context;
  context.Text("pangea link 1");
  context.Text(purpose);
  context.Fixed(agent_id);
  context.Fixed(uplink_run);
  context.Fixed(handler_run);
  const std::vector<uint8_t> bytes = context.Take();
  SecretKey key({});
  crypto_generichash(key.bytes_.data(), kBytes, bytes.data(), bytes.size(), bytes_.data(), kBytes);
  return key;
}

uint64_t RandomNumber() {
  StartSodium();
  uint64_t number = 0;
  randombytes_buf(&number, sizeof(number));
  return number;
}

SealNonce RandomNonce() {
  StartSodium();
  SealNonce nonce;
  randombytes_buf(nonce.data(), nonce.size());
  return nonce;
}

std::vector<uint8_t> Seal(const SecretKey& key, const SealNonce& nonce, Bytes clear, Bytes body) {
  std::vector<uint8_t> packet(clear.begin(), clear.end());
  packet.resize(clear.size() + body.size() + kSealTagBytes);
  crypto_aead_xchacha20poly1305_ietf_encrypt(packet.data() + clear.size(), nullptr, body.data(),
                                             body.size(), clear.data(), clear.size(), nullptr,
                                             nonce.data(), key.bytes().data());
  return packet;
}

std::optional<std::vector<uint8_t>> OpenSealed(const SecretKey& key, const SealNonce& nonce,
                                               Bytes packet, size_t clear_bytes) {
  if (packet.size() < clear_bytes + kSealTagBytes) {
    return std::nullopt;
  }
  const Bytes sealed = packet.subspan(clear_bytes);
  std::vector<uint8_t> body(sealed.size() - kSealTagBytes);
  const int failed = crypto_aead_xchacha20poly1305_ietf_decrypt(
      body.data(), nullptr, nullptr, sealed.data(), sealed.size(), packet.data(), clear_bytes,
      nonce.data(), key.bytes().data());
  if (failed != 0) {
    return std::nullopt;
  }
  return body;
}

int64_t ReplayWindow::Expand(uint32_t low_24_bits) const {
  constexpr int64_t kRange = 1 << 24;
  const int64_t next = highest_ + 1;
  int64_t ahead = (static_cast<int64_t>(low_24_bits) - next) % kRange;
  ahead += ahead < 0 ? kRange : 0;
  return ahead < kRange / 2 || next + ahead < kRange ? next + ahead : next + ahead - kRange;
}

bool ReplayWindow::IsFresh(int64_t number) const {
  if (number < 1 || number <= highest_ - kSize) {
    return false;
  }
  return number > highest_ || !taken_[static_cast<size_t>(number % kSize)];
}

void ReplayWindow::Take(int64_t number) {
  if (number >= highest_ + kSize) {
    taken_.reset();
    highest_ = number;
  }
  for (; highest_ < number; ++highest_) {
    taken_[static_cast<size_t>((highest_ + 1) % kSize)] = false;
  }
  taken_[static_cast<size_t>(number % kSize)] = true;
}

}  // namespace pangea
