#!/usr/bin/env bash
# Tests the stylus over a real kernel, in a virtual machine: ./tools/kernel_test.sh
case "${1:-}" in
-h | --help)
  cat <<'HELP'
usage: tools/kernel_test.sh

The stylus over HID without hardware and without a mock. Debian's stock kernel, the one that linux-image-amd64 stands
for today, boots in QEMU; in it a test program is both ends of the cable, and the kernel is all that is between them:
  hidraw  /dev/uhid, and a USB gadget (FunctionFS) on the emulated bus of dummy_hcd, through libhidapi-hidraw
  libusb  the same gadget through libhidapi-libusb, alone and under Stylet's own stylus (an executable of its own)
  parser  report descriptors, the kernel's own reading of them against Stylet's
Reports are counted and put in order both ways; features, stalls, unplugging and replugging. Times are those of the
virtual machine. This machine's own kernel needs nothing; KVM is used where it works.

The first run installs packages (Debian 12; root or sudo) and fetches the kernel, 70 MB, kept in build/kernel_test.
STYLET_TEST_DATA=DIR   lets the parser meet the descriptors of real devices (DIR/hid/*.hex)
STYLET_KERNEL_SECONDS  after so many seconds the machine is stopped and the test has failed (280)
The log is build/kernel_test/log. Exit status: 0 all passed, 1 a test failed, 2 it could not run.
HELP
  exit 0
  ;;
"") ;;
*) echo "kernel_test.sh: unknown option $1; see --help" >&2; exit 2 ;;
esac
source "$(dirname "$0")/setup.sh"
fail() { printf 'kernel_test.sh: %s\n' "$*" >&2; exit 2; }

modules=(uhid hid-generic usbhid dummy_hcd usb_f_fs)
work=$project/build/kernel_test
log=$work/log
programs=(build/release/bin/stylet_kernel_tests build/release/bin/stylet_kernel_libusb_tests)

# resolve: the package that linux-image-amd64 stands for.
resolve() {
  apt-cache depends linux-image-amd64 2>/dev/null | awk '/Depends: linux-image-[0-9]/ { print $2; exit }'
}

# fetch_kernel PACKAGE: leaves vmlinuz, *.ko and modules, their names in the order they load, in $work/PACKAGE.
fetch_kernel() {
  local package=$1 root version module path
  root=$(mktemp -d "$work/fetch.XXXXXX")
  (cd "$root" && apt-get download "$package" 2>&1 | grep -v 'unsandboxed') || fail "cannot fetch $package: no network, or old package lists (apt-get update)"
  dpkg-deb -x "$root"/*.deb "$root/files"
  version=$(basename "$root"/files/lib/modules/*)
  depmod -b "$root/files" "$version"
  mkdir "$root/kernel"
  for module in "${modules[@]}"; do
    modprobe -d "$root/files" -S "$version" --show-depends "$module"
  done | awk '$1 == "insmod" && !seen[$2]++ { print $2 }' >"$root/paths"
  while read -r path; do
    cp "$path" "$root/kernel"
    basename "$path"
  done <"$root/paths" >"$root/kernel/modules"
  cp "$root/files/boot/vmlinuz-$version" "$root/kernel/vmlinuz"
  rm -rf "${work:?}/$package"
  mv "$root/kernel" "$work/$package"
  rm -rf "$root"
}

# put FILE...: into the guest, at its own path.
put() {
  local file
  for file in "$@"; do
    install -D "$(readlink -f "$file")" "$guest$file"
  done
}

# make_guest KERNEL: $work/initrd, all that the virtual machine has.
make_guest() {
  guest=$(mktemp -d "$work/guest.XXXXXX")
  local libraries=/usr/lib/x86_64-linux-gnu library
  mkdir -p "$guest"/{bin,dev,proc,sys,data/hid,modules}
  cp "$(command -v busybox)" "$guest/bin/busybox"
  cp "${programs[@]}" "$guest"
  cp "$1"/*.ko "$1/modules" "$guest/modules"
  put $libraries/libhidapi-libusb.so.0 $libraries/gconv/UTF-16.so $libraries/gconv/gconv-modules.cache
  for library in $(ldd "${programs[@]}" $libraries/libhidapi-libusb.so.0 | awk '/=> \// { print $3 } $1 ~ /^\// && NF == 2 { print $1 }' |
      grep -v : | sort -u); do
    put "$library"
  done
  [ -z "${STYLET_TEST_DATA:-}" ] || cp "$STYLET_TEST_DATA"/hid/*.hex "$guest/data/hid"
  cat >"$guest/init" <<INIT
#!/bin/busybox sh
/bin/busybox --install -s /bin
mount -t proc none /proc && mount -t sysfs none /sys && mount -t devtmpfs none /dev
mount -t debugfs none /sys/kernel/debug
while read -r module; do insmod "/modules/\$module" || exit; done </modules/modules
mount -t configfs none /sys/kernel/config
status=0
tests() {
  echo "stage: \$1"
  shift
  env STYLET_TEST_DATA=/data GTEST_COLOR=no "\$@" || status=1
}
echo "stage: \$(uname -sr)"
tests "hidraw" /stylet_kernel_tests --gtest_filter='*OverKernel*'
tests "libusb" LD_PRELOAD=libhidapi-libusb.so.0 /stylet_kernel_tests --gtest_filter='*/StylusOverKernel*/Usb'
tests "libusb, stylus" /stylet_kernel_libusb_tests --gtest_filter='*/HidStylusOverKernel*/Usb'
tests "parser" /stylet_kernel_tests --gtest_filter='KernelReadsDescriptors.*'
tests "parser" /stylet_kernel_tests --gtest_filter='HidCorpus.AgreesWithTheKernelOnEveryField'
echo "stylet_kernel_tests: status \$status"
poweroff -f
INIT
  chmod +x "$guest/init"
  (cd "$guest" && find . | cpio --quiet -o -H newc) >"$work/initrd"
  rm -rf "$guest"
}

# /dev/kvm may be there and lead nowhere.
kvm_works() { [ -w /dev/kvm ] && grep -qE '^flags.* (vmx|svm)( |$)' /proc/cpuinfo; }

# run_guest KERNEL: what the machine says goes to $log and, in short, here.
run_guest() {
  # The clock of an emulated processor counts its instructions, 2 ns each: a busy machine takes longer but loses no
  # report, and what sleeps costs no time.
  local accelerator=(-accel tcg -cpu max -icount "shift=1,sleep=off")
  kvm_works && accelerator=(-accel kvm -cpu host)
  timeout "${STYLET_KERNEL_SECONDS:-280}" qemu-system-x86_64 "${accelerator[@]}" -smp 1 -m 512 -kernel "$1/vmlinuz" -initrd "$work/initrd" \
    -append "console=ttyS0 quiet panic=-1 mitigations=off" -display none -monitor none -serial file:/dev/stdout -no-reboot \
    -net none </dev/null 2>&1 | tr -d '\r' | tee "$log" |
    grep --line-buffered -E '^(stage:|\[ +(OK|FAILED|SKIPPED) |  |.*Failure|Kernel panic)' || true
}

install_packages run build test test-ci
mkdir -p "$work"
package=$(resolve)
if [ -z "$package" ]; then
  as_root=()
  [ "$(id -u)" -eq 0 ] || as_root=(sudo)
  "${as_root[@]}" apt-get update >/dev/null || true
  package=$(resolve)
fi
[ -n "$package" ] || fail "apt does not know linux-image-amd64; this test needs Debian's kernel"
stage "Build" build release kernel_tests -DBUILD_TESTING=ON
[ -f "$work/$package/modules" ] || stage "Fetch $package" fetch_kernel "$package"
make_guest "$work/$package"
stage "Boot $package in QEMU" run_guest "$work/$package"
status=$(awk '/^stylet_kernel_tests: status / { print $3 }' "$log")
case "$status" in
0) rm -f "$work/initrd"; bold "Passed: the stylus over a real kernel" ;;
1) bold "FAILED; the log is $log"; exit 1 ;;
*) tail -n 20 "$log"; fail "the virtual machine did not get to its end; the log is $log" ;;
esac
