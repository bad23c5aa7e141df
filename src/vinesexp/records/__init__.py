"""The campaign and its raw files (docs/campaign.md, docs/formats.md)."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__,
    {
        "campaign.load": ["load_campaign", "campaign_problems"],
        "campaign.schema": ["Campaign", "Record"],
        "instrument.ingest": ["read_file"],
        "stored.store": ["open_record", "open_dataset"],
    },
)
