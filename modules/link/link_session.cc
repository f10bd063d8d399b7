#include "link/link_session.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "link/bytes_io.h"

namespace pangea {
namespace {

constexpr size_t kSessionClearBytes = 4;
constexpr size_t kHandshakeClearBytes = 1 + kSealNonceBytes;
constexpr int64_t kMaxNumber = int64_t{1} << 48;
constexpr char kNotOurs[] =
    "not sealed for this session: forged, damaged, of an earlier one, or of a second uplink "
    "of this agent";
constexpr char kTooLarge[] = "larger than any packet";
constexpr char kRepeated[] = "repeated or too old";

LinkKind KindOf(Bytes bytes) { return bytes.empty() ? LinkKind{} : LinkKind{bytes[0]}; }

SealNonce NonceOf(int64_t number) {
  SealNonce nonce{};
  for (size_t i = 0; i < sizeof(number); ++i) {
    nonce[i] = static_cast<uint8_t>(number >> (8 * i));
  }
  return nonce;
}

// Hellos and welcomes have random nonces, because they are few and have no number in a session.
std::vector<uint8_t> SealHandshake(const SecretKey& key, LinkKind kind, Bytes body) {
  const SealNonce nonce = RandomNonce();
  WireWriter clear;
  clear.Fixed(static_cast<uint8_t>(kind));
  clear.Raw(nonce);
  return Seal(key, nonce, clear.Take(), body);
}

std::optional<std::vector<uint8_t>> OpenHandshake(const SecretKey& key, Bytes bytes) {
  if (bytes.size() < kHandshakeClearBytes) {
    return std::nullopt;
  }
  SealNonce nonce;
  std::copy_n(bytes.begin() + 1, nonce.size(), nonce.begin());
  return OpenSealed(key, nonce, bytes, kHandshakeClearBytes);
}

SessionKey KeyOf(const SecretKey& agent_key, std::string_view direction, int32_t agent_id,
                 uint64_t uplink_run, uint64_t handler_run) {
  return {agent_key.Derive(direction, agent_id, uplink_run, handler_run), ReplayWindow()};
}

}  // namespace

std::vector<uint8_t> SessionKey::Seal(const LinkPacket& packet) const {
  const auto low = static_cast<uint32_t>(packet.number);
  const uint8_t clear[kSessionClearBytes] = {
      static_cast<uint8_t>(packet.kind), static_cast<uint8_t>(low), static_cast<uint8_t>(low >> 8),
      static_cast<uint8_t>(low >> 16)};
  return pangea::Seal(key, NonceOf(packet.number), clear, packet.body);
}

std::optional<LinkPacket> SessionKey::Open(Bytes bytes, std::string* refused) {
  if (bytes.size() < kSessionClearBytes) {
    *refused = kNotOurs;
    return std::nullopt;
  }
  const int64_t number =
      window.Expand(static_cast<uint32_t>(bytes[1] | (bytes[2] << 8) | (bytes[3] << 16)));
  // Freshness is checked first, because this is cheap; the number is trusted only after opening.
  const bool fresh = window.IsFresh(number);
  auto body = fresh ? OpenSealed(key, NonceOf(number), bytes, kSessionClearBytes) : std::nullopt;
  if (!body) {
    *refused = fresh ? kNotOurs : kRepeated;
    return std::nullopt;
  }
  window.Take(number);
  return LinkPacket{KindOf(bytes), number, std::move(*body)};
}

UplinkSession::UplinkSession(int32_t agent_id, const SecretKey& agent_key)
    : agent_id_(agent_id),
      agent_key_(agent_key),
      hello_key_(agent_key.Derive("hello", agent_id)),
      welcome_key_(agent_key.Derive("welcome", agent_id)),
      run_(RandomNumber()) {}

std::vector<uint8_t> UplinkSession::Seal(const LinkPacket& packet) {
  if (packet.kind == LinkKind::kHello) {
    last_hello_ = packet.number;
    WireWriter body;
    body.Fixed(run_);
    body.Fixed(handler_run_);
    body.Fixed(packet.number);
    body.Raw(packet.body);
    return SealHandshake(hello_key_, LinkKind::kHello, body.Take());
  }
  if (!up_) {
    throw std::logic_error("only a hello can be sealed before there is a session");
  }
  return up_->Seal(packet);
}

UplinkSession::Opened UplinkSession::Open(Bytes bytes, bool connected) {
  Opened opened;
  if (bytes.size() > kMaxLinkPacketBytes) {
    opened.refused = kTooLarge;
    return opened;
  }
  if (KindOf(bytes) == LinkKind::kWelcome) {
    return OnWelcome(bytes, connected);
  }
  if (down_) {
    opened.packet = down_->Open(bytes, &opened.refused);
    opened.two_handlers = opened.packet && std::exchange(other_welcomed_, false);
  } else {
    opened.refused = "packet before there is a session";
  }
  return opened;
}

UplinkSession::Opened UplinkSession::OnWelcome(Bytes bytes, bool connected) {
  Opened opened;
  const auto body = OpenHandshake(welcome_key_, bytes);
  if (!body) {
    opened.refused = "welcome is forged or damaged";
    return opened;
  }
  WireReader reader(*body);
  const auto uplink_run = reader.Fixed<uint64_t>();
  const auto handler_run = reader.Fixed<uint64_t>();
  const auto hello = reader.Fixed<int64_t>();
  if (!reader.AtEnd() || uplink_run != run_ || hello <= answered_hello_) {
    opened.refused = "welcome answers an earlier hello";
    return opened;
  }
  if (handler_run == handler_run_) {
    return opened;
  }
  // Also a restarted handler welcomes us like this, but then the session's one is silent.
  other_welcomed_ = down_ && connected;
  if (other_welcomed_) {
    return opened;
  }
  // Hellos that are still under way do not have the new run; welcomes to them must be refused.
  answered_hello_ = last_hello_;
  handler_run_ = handler_run;
  up_ = KeyOf(agent_key_, "up", agent_id_, run_, handler_run_);
  down_ = KeyOf(agent_key_, "down", agent_id_, run_, handler_run_);
  opened.new_session = true;
  return opened;
}

HandlerSession::HandlerSession(int32_t agent_id, const SecretKey& agent_key)
    : agent_id_(agent_id),
      agent_key_(agent_key),
      hello_key_(agent_key.Derive("hello", agent_id)),
      welcome_key_(agent_key.Derive("welcome", agent_id)) {}

HandlerSession::Opened HandlerSession::Open(Bytes bytes) {
  Opened opened;
  if (bytes.size() > kMaxLinkPacketBytes) {
    opened.refused = kTooLarge;
    return opened;
  }
  if (KindOf(bytes) == LinkKind::kHello) {
    return OnHello(bytes);
  }
  if (up_) {
    opened.packet = up_->Open(bytes, &opened.refused);
  } else {
    opened.refused = "packet before there is a session";
  }
  return opened;
}

std::optional<HandlerSession::Hello> HandlerSession::OpenHello(Bytes bytes) const {
  const auto body = OpenHandshake(hello_key_, bytes);
  if (!body) {
    return std::nullopt;
  }
  Hello hello;
  WireReader reader(*body);
  hello.uplink_run = reader.Fixed<uint64_t>();
  hello.handler_run = reader.Fixed<uint64_t>();
  hello.packet.kind = LinkKind::kHello;
  hello.packet.number = reader.Fixed<int64_t>();
  const Bytes rest = reader.Rest();
  hello.packet.body.assign(rest.begin(), rest.end());
  const bool valid = reader.ok() && hello.packet.number >= 1 && hello.packet.number < kMaxNumber;
  return valid ? std::optional(std::move(hello)) : std::nullopt;
}

HandlerSession::Opened HandlerSession::OnHello(Bytes bytes) {
  Opened opened;
  std::optional<Hello> hello = OpenHello(bytes);
  if (!hello) {
    opened.refused = kHelloNotOpened;
    return opened;
  }
  const bool current = up_ && hello->uplink_run == uplink_run_ && hello->handler_run == run_;
  if (!current && hello->handler_run != next_run_) {
    opened.welcome = Welcome(*hello);
    return opened;
  }
  if (!current) {
    if (hello->uplink_run != uplink_run_) {
      opened.new_uplink = true;
      opened.two_uplinks = hello->uplink_run == earlier_uplink_run_;
      earlier_uplink_run_ = std::exchange(uplink_run_, hello->uplink_run);
    }
    run_ = next_run_;
    next_run_ = RandomNumber();
    up_ = KeyOf(agent_key_, "up", agent_id_, uplink_run_, run_);
    up_->window = ReplayWindow(hello->packet.number - 1);
    down_ = KeyOf(agent_key_, "down", agent_id_, uplink_run_, run_);
    last_number_ = 0;
  }
  if (!up_->window.IsFresh(hello->packet.number)) {
    opened.refused = kRepeated;
    return opened;
  }
  up_->window.Take(hello->packet.number);
  opened.packet = std::move(hello->packet);
  return opened;
}

std::vector<uint8_t> HandlerSession::Welcome(const Hello& hello) const {
  WireWriter body;
  body.Fixed(hello.uplink_run);
  body.Fixed(next_run_);
  body.Fixed(hello.packet.number);
  return SealHandshake(welcome_key_, LinkKind::kWelcome, body.Take());
}

std::vector<uint8_t> HandlerSession::Seal(LinkKind kind, std::vector<uint8_t> body) {
  if (!down_) {
    throw std::logic_error("nothing can be sealed before there is a session");
  }
  return down_->Seal({kind, ++last_number_, std::move(body)});
}

}  // namespace pangea
