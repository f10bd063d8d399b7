#pragma once

// How NATS is reached: where, whom to trust there, and as whom.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace pangea {

struct NatsAccess {
  std::string url =
      "nats://127.0.0.1:4222";  // several, of one cluster of NATS: with commas between
  std::filesystem::path ca;     // whose certificate the server's has to be signed by; for tls://
  std::filesystem::path credentials;  // "user: NAME" and "password: WORD"; mode 0600; empty: nobody

  std::vector<std::string> Urls() const;
  bool tls() const;
  // Throws std::runtime_error, one line with the mend, when this is not to be tried: a password
  // over plain text, tls:// without an authority, a file of credentials that others can read.
  void Check() const;
};

struct NatsCredentials {
  std::string user;
  std::string password;
};
// Throws std::runtime_error.
NatsCredentials ReadCredentials(const std::filesystem::path& file);

}  // namespace pangea
