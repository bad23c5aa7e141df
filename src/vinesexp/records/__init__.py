"""The campaign and its raw files (docs/campaign.md, docs/formats.md)."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__,
    {
        "load_campaign": "vinesexp.records.campaign.load",
        "campaign_problems": "vinesexp.records.campaign.load",
        "Campaign": "vinesexp.records.campaign.schema",
        "Record": "vinesexp.records.campaign.schema",
        "read_file": "vinesexp.records.instrument.ingest",
        "open_record": "vinesexp.records.stored.store",
        "open_dataset": "vinesexp.records.stored.store",
    },
)
