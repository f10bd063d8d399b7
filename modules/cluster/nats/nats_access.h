#pragma once

// How to connect to NATS: the address, the trusted authority, and the user.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace pangea {

struct NatsAccess {
  std::string url =
      "nats://127.0.0.1:4222";  // or several nodes of one NATS cluster, separated by commas
  std::filesystem::path ca;     // certificate of the authority that signed the server's; for tls://
  std::filesystem::path credentials;  // "user: NAME" and "password: WORD"; mode 0600; empty: none

  std::vector<std::string> Urls() const;
  bool tls() const;
  // Throws std::runtime_error, one line with advice, for settings that are not safe: a password
  // over an unencrypted connection, tls:// without an authority, or credentials that others can
  // read.
  void Check() const;
};

struct NatsCredentials {
  std::string user;
  std::string password;
};
// Throws std::runtime_error.
NatsCredentials ReadCredentials(const std::filesystem::path& file);

}  // namespace pangea
