/* msfp_hash.h: a number that tells bytes from others: for identities and damage, not against forgery. */
#ifndef MSFP_HASH_H
#define MSFP_HASH_H
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define MSFP_HASH_START 14695981039346656037U

/* That of the bytes which gave `sum`, MSFP_HASH_START for none, with further ones: FNV-1a over words of eight bytes, then
 * over the bytes that are left. The high half is folded into the low one, else two changes of a sign would cancel. */
static inline uint64_t msfp_hash(uint64_t sum, const void *data, size_t size)
{
    const unsigned char *bytes = data;
    uint64_t word;
    size_t i = 0;
    for (; i + sizeof word <= size; i += sizeof word) {
        memcpy(&word, bytes + i, sizeof word);
        sum = (sum ^ word) * 1099511628211U;
        sum ^= sum >> 32;
    }
    for (; i < size; ++i)
        sum = (sum ^ bytes[i]) * 1099511628211U;
    return sum;
}

#endif
