// stylet-draco: decodes meshes of Draco from standard input to standard output (engine/gltf/draco_request.h). Once
// it has read its input it may compute, allocate, write to what is open and end; the kernel refuses it all else.
#include "engine/gltf/draco_request.h"

#include <draco/compression/decode.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <span>
#include <vector>

namespace {

using stylet::gltf::DracoRequest;
using stylet::gltf::kDracoBroken;
using stylet::gltf::kDracoNotAsDeclared;

#if defined(__x86_64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_AARCH64;
#endif

/// Where the kernel has no seccomp, the limits that the caller has set hold this process alone.
void allow_only_computing() {
  static constexpr std::array kAllowed = {SYS_write,      SYS_mmap,        SYS_munmap, SYS_mremap, SYS_mprotect,
                                          SYS_brk,        SYS_madvise,     SYS_futex,  SYS_exit,   SYS_rt_sigreturn,
                                          SYS_exit_group, SYS_sched_yield, SYS_getpid, SYS_gettid};
  std::vector<sock_filter> program = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, arch)),  // numbers of another mean other calls
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kArchitecture, 1, 0), BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr))};
  for (const long call : kAllowed) {
    program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint32_t>(call), 0, 1));
    program.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
  }
  program.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM));
  const sock_fprog filter{.len = static_cast<unsigned short>(program.size()), .filter = program.data()};
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0) prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter);
}

std::vector<char> read_all(int file) {
  std::vector<char> all;
  std::vector<char> part(1u << 16);
  for (ssize_t count = 0; (count = read(file, part.data(), part.size())) != 0;) {
    if (count < 0 && errno != EINTR) return {};
    if (count > 0) all.insert(all.end(), part.begin(), part.begin() + count);
  }
  return all;
}

bool write_all(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = write(STDOUT_FILENO, bytes.data(), bytes.size());
    if (count <= 0) return false;
    bytes = bytes.subspan(count);
  }
  return true;
}

int decode(const DracoRequest& request, std::span<const char> compressed) {
  draco::DecoderBuffer buffer;
  buffer.Init(compressed.data(), compressed.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) return kDracoBroken;
  const draco::Mesh& mesh = *decoded.value();
  const draco::PointAttribute* position = mesh.GetAttributeByUniqueId(request.position_id);
  if (position == nullptr || position->num_components() != 3 || mesh.num_points() != request.vertices ||
      mesh.num_faces() != request.indices / 3 || request.indices % 3 != 0) {
    return kDracoNotAsDeclared;
  }
  std::vector<std::array<float, 3>> points(request.vertices);
  for (std::uint32_t i = 0; i < request.vertices; ++i) {
    if (!position->ConvertValue(position->mapped_index(draco::PointIndex(i)), 3, points[i].data()))
      return kDracoBroken;
  }
  std::vector<std::array<std::uint32_t, 3>> faces(request.indices / 3);
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) faces[f][k] = mesh.face(draco::FaceIndex(f))[k].value();
  }
  return write_all(std::as_bytes(std::span(points))) && write_all(std::as_bytes(std::span(faces))) ? 0 : kDracoBroken;
}

int decode_all(std::span<const char> input) {
  for (std::size_t at = 0; at < input.size();) {
    DracoRequest request;
    if (input.size() - at < sizeof request) return kDracoBroken;
    std::memcpy(&request, input.data() + at, sizeof request);
    at += sizeof request;
    if (input.size() - at < request.bytes) return kDracoBroken;
    if (const int status = decode(request, input.subspan(at, request.bytes)); status != 0) return status;
    at += request.bytes;
  }
  return 0;
}

}  // namespace

int main() {
  const std::vector<char> input = read_all(STDIN_FILENO);
  allow_only_computing();
  // At once: what else runs at the end, a sanitizer's checks say, needs more than computing.
  syscall(SYS_exit_group, decode_all(input));
}
