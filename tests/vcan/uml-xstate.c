/*
 * Lets user-mode-linux up to 6.12 run on processors with a large register state.
 *
 * UML keeps the floating-point registers of its processes in a buffer of fixed size. On hosts whose
 * XSAVE area is larger (AVX-512 with PKRU and AMX: 11008 bytes) ptrace refuses
 * PTRACE_SETREGSET(NT_X86_XSTATE) unless the whole area is given, and the guest panics. This library,
 * loaded with LD_PRELOAD, wraps ptrace(): it merges what UML gives into the full area of the traced
 * process and leaves the components UML has no room for as they are. Where the host's area fits,
 * every call passes through unchanged.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/uio.h>

#ifndef NT_X86_XSTATE
#define NT_X86_XSTATE 0x202
#endif

#define XSTATE_BV_OFFSET 512 /* header word: which components are not in their initial state */

static char area[65536] __attribute__((aligned(64)));

/* Components that end behind `size` bytes of the uncompacted area. */
static uint64_t components_beyond(uint64_t present, size_t size)
{
	uint64_t beyond = 0;
	for (int i = 2; i < 63; i++) {
		uint32_t length, offset, c = i, d;
		if (!(present >> i & 1))
			continue;
		__asm__ volatile("cpuid" : "=a"(length), "=b"(offset), "+c"(c), "=d"(d) : "a"(13));
		if (offset + length > size)
			beyond |= 1ull << i;
	}
	return beyond;
}

long ptrace(enum __ptrace_request request, ...)
{
	static long (*real)(enum __ptrace_request, ...);
	va_list arguments;
	va_start(arguments, request);
	long pid = va_arg(arguments, long);
	void *addr = va_arg(arguments, void *);
	void *data = va_arg(arguments, void *);
	va_end(arguments);
	if (!real)
		real = (long (*)(enum __ptrace_request, ...))dlsym(RTLD_NEXT, "ptrace");
	if (request != PTRACE_SETREGSET || addr != (void *)NT_X86_XSTATE)
		return real(request, pid, addr, data);

	const struct iovec *given = data;
	struct iovec full = {area, sizeof area};
	if (real(PTRACE_GETREGSET, pid, addr, &full) < 0 || full.iov_len <= given->iov_len)
		return real(request, pid, addr, data);

	uint64_t current, wanted;
	memcpy(&current, area + XSTATE_BV_OFFSET, sizeof current);
	memcpy(&wanted, (char *)given->iov_base + XSTATE_BV_OFFSET, sizeof wanted);
	const uint64_t keep = components_beyond(current | wanted, given->iov_len);
	const uint64_t merged = (wanted & ~keep) | (current & keep);
	memcpy(area, given->iov_base, given->iov_len);
	memcpy(area + XSTATE_BV_OFFSET, &merged, sizeof merged);
	return real(request, pid, addr, &full);
}
